"""Names that files bring, made fit to be shown: on a terminal, in a picture, on one line."""


def legible(text: str, encoding: str | None = None) -> str:
    """Returns text that can be shown anywhere: one line, without control characters or what
    `encoding` cannot express.

    Control characters, which could move a terminal's cursor or change its colours, become \\x1b and
    the like; white space of any kind one space; halves of surrogate pairs and signs beyond the
    encoding (UTF-8 without one) "?".

    Example:
      legible("a\\x1b[31mred") == "a\\\\x1b[31mred"
    """
    line = text if text.isprintable() else "".join(map(_legible_sign, text))
    known = encoding or "utf-8"
    return line.encode(known, "replace").decode(known, "replace")


def _legible_sign(sign: str) -> str:
    if sign.isprintable():
        return sign
    if sign.isspace() and sign not in "\x1c\x1d\x1e\x1f\x85":
        return " "
    return "?" if 0xD800 <= ord(sign) <= 0xDFFF else sign.encode("unicode_escape").decode()
