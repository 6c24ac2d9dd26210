"""What PDDL and its relatives have beyond STRIPS with action costs: by which word it is known, its
name, and what to do.

The reader refuses each by name. A domain may require what it does not use: `REQUIREMENTS` are the
known flags.
"""

_QUANTIFIED = ("quantified formulas", "write the formula once for each object")
_NUMERIC = ("numeric conditions", "only action costs are counted, by (increase (total-cost) ...)")
_NUMERIC_EFFECT = (
    "numeric effects",
    "only action costs are counted, by (increase (total-cost) ...)",
)
_CHANCE = ("non-deterministic effects", "give the action effects that are certain")
_TRAJECTORY = ("trajectory constraints", "state what must hold at the end in (:goal ...)")
_CERTAIN = ("uncertain starts", "state in (:init ...) what holds")
_DURATIVE = ("durative actions", "leave the durations out and write (:action ...)")
TIMED = ("timed initial literals", "state in (:init ...) what holds at the beginning")

FORMULAS = {
    "or": ("disjunctions", "write an action for each case"),
    "imply": ("implications", "write an action for each case"),
    "forall": _QUANTIFIED,
    "exists": ("quantified formulas", "add the variable to :parameters"),
    "when": ("conditional effects", "write an action for each case"),
    "preference": ("preferences", "state it as a condition, or leave it out"),
    "oneof": _CHANCE,
    "probabilistic": _CHANCE,
    "unknown": _CERTAIN,
    **dict.fromkeys((">=", "<=", ">", "<"), _NUMERIC),
    **dict.fromkeys(("assign", "decrease", "scale-up", "scale-down", "change"), _NUMERIC_EFFECT),
    **dict.fromkeys(("over", "at-start", "at-end"), _DURATIVE),
    **dict.fromkeys(
        (
            "always",
            "sometime",
            "within",
            "at-most-once",
            "sometime-after",
            "sometime-before",
            "always-within",
            "hold-during",
            "hold-after",
        ),
        _TRAJECTORY,
    ),
}
"""Heads of formulas: {word: (what it is called, what to do)}."""

SECTIONS = {
    ":durative-action": _DURATIVE,
    ":derived": ("derived predicates", "give the predicate to actions as an effect"),
    ":axiom": ("derived predicates", "give the predicate to actions as an effect"),
    ":constraints": _TRAJECTORY,
    ":process": ("continuous processes", "write (:action ...)"),
    ":event": ("events", "write (:action ...)"),
    ":observe": ("observations", "state in (:init ...) what holds"),
    ":task": ("hierarchical tasks", "state what must hold at the end in (:goal ...)"),
    ":method": ("hierarchical tasks", "state what must hold at the end in (:goal ...)"),
    ":htn": ("hierarchical tasks", "state what must hold at the end in (:goal ...)"),
}
"""Sections of a domain or problem, likewise."""

LOGIC = frozenset(("=", "not", "and", "or", "imply", "forall", "exists", "when"))
"""Words that no predicate can have as its name."""

REQUIREMENTS = frozenset(
    (
        ":action-costs",
        ":action-expansions",
        ":adl",
        ":assignment-fluents",
        ":conditional-effects",
        ":constraints",
        ":contingent",
        ":continuous-effects",
        ":dag-expansions",
        ":derived-predicates",
        ":disjunctive-effects",
        ":disjunctive-preconditions",
        ":domain-axioms",
        ":duration-inequalities",
        ":durative-actions",
        ":equality",
        ":events",
        ":existential-preconditions",
        ":expression-evaluation",
        ":factored-privacy",
        ":fluents",
        ":foreach-expansions",
        ":goal-utilities",
        ":hierarchy",
        ":htn",
        ":mdp",
        ":method-preconditions",
        ":multi-agent",
        ":negative-preconditions",
        ":non-deterministic",
        ":numeric-fluents",
        ":object-fluents",
        ":open-world",
        ":partial-observability",
        ":preferences",
        ":probabilistic-effects",
        ":processes",
        ":quantified-preconditions",
        ":rewards",
        ":safety-constraints",
        ":strips",
        ":subgoal-through-axioms",
        ":time",
        ":timed-effects",
        ":timed-initial-fluents",
        ":timed-initial-literals",
        ":true-negation",
        ":typing",
        ":ucpop",
        ":unfactored-privacy",
        ":universal-preconditions",
        ":unknown",
    )
)
"""What (:requirements ...) may name."""
