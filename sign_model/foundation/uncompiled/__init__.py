"""A traced function run by NumPy, without compiling anything: slower by orders of magnitude, but
its first answer is there in a fraction of the seconds that a compiler takes.
"""
