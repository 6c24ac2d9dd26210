"""Side-by-side measurements against the native peers installed; nothing in the library imports
them.
"""
