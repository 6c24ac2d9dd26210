"""One file per format read or written; `files` reads and writes whole files. Described in
docs/formats.md.
"""
