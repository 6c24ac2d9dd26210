"""What both packages stand on: how a program is compiled, how many cores it may use, records of
arrays, sets as words of bits, sizes to pad to, and how files are read and written.

Modules here know neither grids nor signs, import nothing of ours but each other, and may be
imported from anywhere.
"""
