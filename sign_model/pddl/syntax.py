"""PDDL text -> nested forms that know their line, and the one error that all of the reader raises.

PDDL ignores case, hence everything is lowered here. A form is a list of words and forms; both keep
the line they began on, so that every later complaint can name it. Forms may be nested to any depth:
nothing here or in `pddl` calls itself.

Text is UTF-8, or UTF-16 or UTF-32 with a byte order mark. Comments may hold bytes of any other
encoding: they are not read.
"""

import codecs
import os
import pathlib
import re
from collections.abc import Iterator

from sign_model.clock import NO_LIMIT, Clock
from sign_model.foundation.files import FileError, read_bytes

MAX_BYTES = 1 << 28
"""The largest PDDL file that is read, in bytes."""

# "?" begins a new word, as other planners read it: (aircraft?a) is (aircraft ?a).
_TOKEN = re.compile("[()]|\\?[^\\s\ufeff()?]*|[^\\s\ufeff()?]+")
_COMMENT = re.compile(r";[^\n]*")
_ODD = re.compile(r"[^\x20-\x7e\s]")
_LONG_QUOTE = re.compile(r"'([^']{60})[^']{20,}'")
_MARKS = (  # the longer mark first: that of UTF-32 begins like that of UTF-16
    (codecs.BOM_UTF32_LE, "utf-32"),
    (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)
_PART = 1 << 16
"""How many signs of a line are taken at once."""


class PddlError(ValueError):
    """PDDL that cannot be read: the message is one line, `file:line: what is wrong and what to
    do`.

    Examples:
      >>> import sign_model
      >>> try:
      ...     sign_model.load("(define (domain door)", "(define (problem out) (:domain door))")
      ... except sign_model.PddlError as error:
      ...     print(error)
      <domain>:1: this '(' is never closed: add the missing ')'
    """

    def __init__(self, message: str, *, file: str, line: int | None = None) -> None:
        message = _LONG_QUOTE.sub(r"'\1...'", message)
        super().__init__(f"{file}:{line}: {message}" if line else f"{file}: {message}")


class Word(str):
    """A lower-case token and its line."""

    __slots__ = ("line",)
    line: int

    def __new__(cls, text: str, line: int) -> "Word":
        word = super().__new__(cls, text)
        word.line = line
        return word


class Form(list):
    """The content of two parentheses, and the line of the opening one."""

    __slots__ = ("line",)

    def __init__(self, line: int) -> None:
        super().__init__()
        self.line = line

    @property
    def head(self) -> str:
        """The first word; empty where there is none."""
        return self[0] if self and isinstance(self[0], Word) else ""


def read_source(source: str | pathlib.Path) -> tuple[str, str]:
    """Returns (text, name for messages) of a path, or of PDDL text given as it is (a string that
    holds a parenthesis).
    """
    if isinstance(source, str) and "(" in source and not os.path.isfile(source):
        return _plain_ends(source), "<text>"
    path = pathlib.Path(source)
    try:
        content = read_bytes(path, what="PDDL file", most=MAX_BYTES)
    except FileError as error:
        raise PddlError(str(error).removeprefix(f"{path}: "), file=str(path)) from None
    encoding = next((name for mark, name in _MARKS if content.startswith(mark)), "utf-8")
    # A byte that is no UTF-8 becomes a lone surrogate: nobody minds it in a comment, and in a word
    # `_tokens` tells its line.
    errors = "surrogateescape" if encoding == "utf-8" else "replace"
    return _plain_ends(content.decode(encoding, errors)), str(path)


def _plain_ends(text: str) -> str:
    """The text with every line ended by a line feed, without a byte order mark."""
    if "\r" in text:
        text = text.replace("\r\n", "\n").replace("\r", "\n")
    return text.removeprefix("\ufeff")


def read_form(text: str, file: str, clock: Clock = NO_LIMIT) -> Form:
    """Returns the one form of `text`: (define ...); PddlError where parentheses don't match or
    there is none.
    """
    stack: list[Form] = []
    whole: Form | None = None
    for line, tokens in _lines(text, file, clock):
        for token in tokens:
            if whole is not None:
                message = (
                    f"'{token}' comes after the end of (define ...): remove it, or one ')' too many"
                )
                raise PddlError(message, file=file, line=line)
            if token == "(":
                stack.append(Form(line))
            elif not stack:
                raise PddlError(
                    f"'{token}' comes before the first '(': a PDDL file is one (define ...)",
                    file=file,
                    line=line,
                )
            elif token == ")":
                done = stack.pop()
                if stack:
                    stack[-1].append(done)
                else:
                    whole = done
            else:
                stack[-1].append(Word(token, line))
    if stack:
        raise PddlError(
            "this '(' is never closed: add the missing ')'", file=file, line=stack[-1].line
        )
    if whole is None:
        raise PddlError("the file is empty: a PDDL file is one (define ...)", file=file)
    return whole


def _lines(text: str, file: str, clock: Clock) -> Iterator[tuple[int, list[str]]]:
    """The lower-case tokens of each line, and its number; long lines come in parts, so that the
    time limit is asked.
    """
    if ";" in text:
        text = _COMMENT.sub("", text)
    is_plain = _ODD.search(text) is None
    for line, content in enumerate(text.lower().split("\n"), 1):
        begin = 0
        while begin < len(content):
            end = begin + _PART
            while end < len(content) and content[end] not in "() \t":  # never cut a word
                end += 1
            tokens = _TOKEN.findall(content, begin, end)
            odd = (
                None
                if is_plain
                else next((token for token in tokens if not token.isprintable()), None)
            )
            if odd is not None:
                raise PddlError(_unprintable(odd), file=file, line=line)
            clock.check()
            yield line, tokens
            begin = end


def _unprintable(token: str) -> str:
    """What to say of a word with a sign that no text has."""
    code = next(ord(sign) for sign in token if not sign.isprintable())
    what = (
        f"the byte 0x{code - 0xDC00:02X}" if 0xDC80 <= code <= 0xDCFF else f"the sign U+{code:04X}"
    )
    return (
        f"not a text file in UTF-8: {what} is outside of a comment; remove it, or save the file"
        " as UTF-8"
    )
