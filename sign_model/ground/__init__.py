"""The base of both packages: how a program is compiled, how many cores it may use, how files are
read and written.

Modules here know neither grids nor signs, import nothing of ours but each other, and may be
imported from anywhere.
"""
