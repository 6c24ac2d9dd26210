"""PDDL text -> nested forms that know their line, and the one error that all of the reader raises.

PDDL ignores case, hence everything is lowered here. A form is a list of words and forms; both keep
the line they began on, so that every later complaint can name it.
"""

import pathlib
import re
from collections.abc import Iterator

_TOKEN = re.compile(r";[^\n]*|[()]|[^\s();]+|\n")


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
        super().__init__(f"{file}:{line}: {message}" if line else f"{file}: {message}")


class Word(str):
    """A lower-case token and the line it stands on."""

    line: int

    def __new__(cls, text: str, line: int) -> "Word":
        word = super().__new__(cls, text)
        word.line = line
        return word


class Form(list):
    """What stands between two parentheses, and the line of the opening one."""

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
    if isinstance(source, str) and "(" in source:
        return source, "<text>"
    path = pathlib.Path(source)
    try:
        return path.read_text(encoding="utf-8", errors="strict"), str(path)
    except UnicodeDecodeError:
        raise PddlError("not a text file: give a PDDL file in UTF-8", file=str(path)) from None
    except OSError as error:
        raise PddlError(
            f"cannot be read ({error.strerror}): give the path of a PDDL file, or its text",
            file=str(path),
        ) from None


def read_form(text: str, file: str) -> Form:
    """Returns the one form of `text`: (define ...); PddlError where parentheses don't match or
    there is none.
    """
    stack: list[Form] = []
    whole: Form | None = None
    for token, line in _tokens(text):
        if whole is not None:
            raise PddlError(
                f"'{token}' stands after the end of (define ...): remove it, or one ')' too many",
                file=file,
                line=line,
            )
        if token == "(":
            stack.append(Form(line))
        elif not stack:
            raise PddlError(
                f"'{token}' stands before the first '(': a PDDL file is one (define ...)",
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


def _tokens(text: str) -> Iterator[tuple[str, int]]:
    line = 1
    for match in _TOKEN.finditer(text.lower()):
        token = match.group()
        if token == "\n":
            line += 1
        elif token[0] != ";":
            yield token, line
