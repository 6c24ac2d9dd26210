"""What an answer says: in words, as plain data, as a plan, and what would follow if things were
otherwise.
"""
