"""Which tagged things are obstacles, and which of them can be destroyed: rules that are data,
not code.
"""

import importlib.resources
import math
from collections.abc import Sequence
from typing import Any, NamedTuple, Protocol

from srt_jax.formats.files import PathLike
from srt_jax.formats.json_text import fields_of, read_json

FORMAT, VERSION = "srt-jax tag rules", 1


class Tags(Protocol):
    """What rules look at: a mapping of keys to values, or osmium's tags."""

    def get(self, key: str, default: Any = None, /) -> Any: ...


class TagRule(NamedTuple):
    """Things with a tag `key` are obstacles.

    values: of the tag that count; empty: all but `excepted`. destroyable, removal_cost: as in
      `Obstacle`.
    width: metres; the thing is a line, such as a fence, made that wide. None: it is an area.
    """

    key: str
    values: tuple[str, ...] = ()
    excepted: tuple[str, ...] = ()
    destroyable: bool = True
    removal_cost: float = 1.0
    width: float | None = None

    def fits(self, tags: Tags) -> bool:
        """Whether a thing with these tags is meant."""
        value = tags.get(self.key)
        return (
            value is not None
            and value not in self.excepted
            and (not self.values or value in self.values)
        )


def matching(rules: Sequence[TagRule], tags: Tags) -> TagRule | None:
    """Returns the first rule that fits; None where the thing is no obstacle."""
    return next((rule for rule in rules if rule.fits(tags)), None)


def default_rules() -> tuple[TagRule, ...]:
    """Returns the rules that come with the package: buildings stand firm, fences, hedges and
    walls can be destroyed.
    """
    with importlib.resources.as_file(
        importlib.resources.files("srt_jax.data").joinpath("tag_rules.json")
    ) as path:
        return read_rules(path)


def read_rules(path: PathLike) -> tuple[TagRule, ...]:
    """Returns the rules in a JSON file (docs/formats.md), in order: the first that fits decides.

    Raises:
      ValueError: the file is missing or breaks a rule; the message says where.
    """
    document = read_json(path, "table of tag rules")
    try:
        fields = fields_of("the file", document, "format", "version", "rules")
        if (fields["format"], fields["version"]) != (FORMAT, VERSION) or not isinstance(
            fields["rules"], list
        ):
            raise ValueError(
                f"a table of tag rules has the format {FORMAT!r}, version {VERSION}, and a list of"
                " rules"
            )
        rules = tuple(_rule(f"rules[{index}]", item) for index, item in enumerate(fields["rules"]))
        if not rules:
            raise ValueError(
                "there is no rule in it, so that nothing would be an obstacle: give at least one"
            )
        return rules
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error


def _rule(where: str, item: object) -> TagRule:
    defaults: dict[str, Any] = {
        "values": [],
        "except": [],
        "destroyable": True,
        "removal_cost": 1.0,
        "width": None,
    }
    fields = fields_of(where, item, "key", **defaults)
    if not isinstance(fields["key"], str):
        raise ValueError(f"{where}: key must be a text, got {fields['key']!r}")
    for name in ("values", "except"):
        if not (
            isinstance(fields[name], list) and all(isinstance(value, str) for value in fields[name])
        ):
            raise ValueError(f"{where}: {name} must be a list of texts, got {fields[name]!r}")
    if not isinstance(fields["destroyable"], bool):
        raise ValueError(
            f"{where}: destroyable must be true or false, got {fields['destroyable']!r}"
        )
    for name in ("removal_cost", "width"):
        if fields[name] is not None and not _is_positive(fields[name]):
            raise ValueError(f"{where}: {name} must be a positive number, got {fields[name]!r}")
    return TagRule(
        key=fields["key"],
        values=tuple(fields["values"]),
        excepted=tuple(fields["except"]),
        destroyable=fields["destroyable"],
        removal_cost=float(fields["removal_cost"] or 1.0),
        width=fields["width"],
    )


def _is_positive(value: object) -> bool:
    return (
        isinstance(value, int | float)
        and not isinstance(value, bool)
        and value > 0
        and math.isfinite(value)
    )
