"""Which tagged things are obstacles, and which of them can be destroyed: rules that are data,
not code.
"""

import importlib.resources
import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, Protocol

from srt_jax.formats.containers.json_text import fields_of, is_version, read_json
from srt_jax.formats.shared.whole_files import PathLike

FORMAT, VERSION = "srt-jax tag rules", 1


class Tags(Protocol):
    """What rules look at: a mapping of keys to values, or osmium's tags."""

    def get(self, key: str, default: Any = None, /) -> Any: ...


class Condition(NamedTuple):
    """What a rule demands of one more tag.

    values: of the tag that fit, None among them for things without the tag; empty: all but
    `excepted`. below, at_least: the value is a number below, or at least, that.
    """

    key: str
    values: tuple[str | None, ...] = ()
    excepted: tuple[str | None, ...] = ()
    below: float | None = None
    at_least: float | None = None

    def holds(self, tags: Tags) -> bool:
        """Whether a thing with these tags meets the condition.

        Of several values "a;b" one is enough to fit, but every number must lie where it should.
        """
        values = _values(tags.get(self.key)) or [None]
        fits = [
            v for v in values if v not in self.excepted and (not self.values or v in self.values)
        ]
        numbers = [_number(value) for value in values]
        is_low = self.below is None or max(numbers) < self.below
        return bool(fits) and is_low and (self.at_least is None or min(numbers) >= self.at_least)


class TagRule(NamedTuple):
    """Things with a tag `key` are obstacles, where `also` holds.

    values: of the tag that count; empty: all but `excepted`. destroyable, removal_cost: as in
    `Obstacle`. width: metres; the thing is a line, such as a fence, made that wide. None: it is an
    area. also: conditions on further tags, all of which must hold. obstacle: False: such things
    are no obstacles, whatever the rules after this one say.
    """

    key: str
    values: tuple[str, ...] = ()
    excepted: tuple[str, ...] = ()
    destroyable: bool = True
    removal_cost: float = 1.0
    width: float | None = None
    also: tuple[Condition, ...] = ()
    obstacle: bool = True

    def fits(self, tags: Tags) -> bool:
        """Whether a thing with these tags is meant; of several values "a;b" one is enough."""
        values = [value for value in _values(tags.get(self.key)) if value not in self.excepted]
        is_meant = any(not self.values or value in self.values for value in values)
        return is_meant and all(condition.holds(tags) for condition in self.also)


def matching(rules: Sequence[TagRule], tags: Tags) -> TagRule | None:
    """Returns the first rule that fits; None where the thing is no obstacle."""
    rule = next((rule for rule in rules if rule.fits(tags)), None)
    return rule if rule is not None and rule.obstacle else None


def is_passed_over(rules: Sequence[TagRule], tags: Tags) -> bool:
    """Whether a thing would be an obstacle if no rule said that such things are none."""
    if matching(rules, tags) is not None:
        return False
    return matching([rule for rule in rules if rule.obstacle], tags) is not None


class CachedRules:
    """The rules with the answers given so far: most things of a map have one of a few sets of
    values.

    Example:
      rule, is_passed = CachedRules(default_rules()).decide({"building": "yes"})
    """

    def __init__(self, rules: Sequence[TagRule]) -> None:
        self._rules = tuple(rules)
        self._keys = {rule.key for rule in rules}
        self._keys |= {condition.key for rule in rules for condition in rule.also}
        self._known: dict[frozenset[tuple[str, ...]], tuple[TagRule | None, bool]] = {}

    def decide(self, tags: Mapping[str, Any]) -> tuple[TagRule | None, bool]:
        """Returns (`matching`, `is_passed_over`) of a thing with these tags."""
        # A rule looks at nothing but the values of the keys it names.
        seen = frozenset((key, *_values(tags[key])) for key in self._keys & tags.keys())
        if seen not in self._known:
            own = dict(tags)
            self._known[seen] = matching(self._rules, own), is_passed_over(self._rules, own)
        return self._known[seen]


def default_rules() -> tuple[TagRule, ...]:
    """Returns the rules that come with the package, fit for a robot on the ground.

    Buildings and water are indestructible; fences, hedges and walls can be destroyed; what lies
    underground, in a tunnel, on a roof or on another storey is no obstacle.
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
        is_known = fields["format"] == FORMAT and is_version(fields["version"], VERSION)
        if not (is_known and isinstance(fields["rules"], list)):
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
    defaults: dict[str, Any] = {"values": [], "except": [], "and": {}, "obstacle": True}
    defaults |= {"destroyable": True, "removal_cost": 1.0, "width": None}
    fields = fields_of(where, item, "key", **defaults)
    if not isinstance(fields["key"], str):
        raise ValueError(f"{where}: key must be a text, got {fields['key']!r}")
    for name in ("values", "except"):
        if not (
            isinstance(fields[name], list) and all(isinstance(value, str) for value in fields[name])
        ):
            raise ValueError(f"{where}: {name} must be a list of texts, got {fields[name]!r}")
    for name in ("destroyable", "obstacle"):
        if not isinstance(fields[name], bool):
            raise ValueError(f"{where}: {name} must be true or false, got {fields[name]!r}")
    for name in ("removal_cost", "width"):
        if fields[name] is not None and not _is_positive(fields[name]):
            raise ValueError(
                f"{where}: {name} must be a positive finite number, got {fields[name]!r}"
            )
    if not isinstance(fields["and"], dict):
        raise ValueError(
            f"{where}: and must be an object of tags and what fits, got {fields['and']!r}"
        )
    return TagRule(
        key=fields["key"],
        values=tuple(fields["values"]),
        excepted=tuple(fields["except"]),
        destroyable=fields["destroyable"],
        removal_cost=float(fields["removal_cost"] or 1.0),
        width=fields["width"],
        also=tuple(
            _condition(f"{where}: and: {key}", key, given) for key, given in fields["and"].items()
        ),
        obstacle=fields["obstacle"],
    )


def _condition(where: str, key: str, given: object) -> Condition:
    """Returns the condition written as a list of values, or as an object with other demands."""
    if isinstance(given, list):
        given = {"values": given}
        if not given["values"]:
            raise ValueError(
                f"{where}: no value fits an empty list: name some, null for no such tag"
            )
    defaults: dict[str, Any] = {"values": [], "except": [], "below": None, "at_least": None}
    fields = fields_of(where, given, **defaults)
    for name in ("values", "except"):
        items = fields[name]
        if not (
            isinstance(items, list)
            and all(value is None or isinstance(value, str) for value in items)
        ):
            raise ValueError(
                f"{where}: {name} must be a list of texts, or null for no such tag, got {items!r}"
            )
    for name in ("below", "at_least"):
        if fields[name] is not None and not _is_finite(fields[name]):
            raise ValueError(f"{where}: {name} must be a number, got {fields[name]!r}")
    return Condition(
        key, tuple(fields["values"]), tuple(fields["except"]), fields["below"], fields["at_least"]
    )


def _values(value: Any) -> list[str]:
    """Returns the values of a tag, several where it lists them "a;b"; [] where it has none.

    Tags that come from GeoJSON may be numbers, true or false.
    """
    if value is None or isinstance(value, bool):
        return [] if value is None else ["yes" if value else "no"]
    text = f"{value:.15g}" if isinstance(value, int | float) else str(value)
    return [part.strip() for part in text.split(";") if part.strip()]


def _number(value: str | None) -> float:
    """Returns the number a value is; 0 for what is none, as a missing layer is layer 0."""
    try:
        number = float(value or "0")
    except ValueError:
        return 0.0
    return number if math.isfinite(number) else 0.0


def _is_finite(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _is_positive(value: object) -> bool:
    return _is_finite(value) and value > 0  # type: ignore[operator]
