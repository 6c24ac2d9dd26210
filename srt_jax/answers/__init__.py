"""What an answer says: in words, as plain data, as a table, beside other answers, and what would
follow if things were otherwise.
"""
