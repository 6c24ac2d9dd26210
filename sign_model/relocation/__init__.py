"""The smart relocation task on the symbolic level, and MAP over a working memory inside jit
(PY16 §2, §3.1).
"""
