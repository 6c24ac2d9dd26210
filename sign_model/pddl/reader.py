"""PDDL -> the lifted records of a planning task: typed STRIPS with constants, equality, negative
conditions and action costs.

    object -> its name, with its types            predicate -> name and the types of its roles
    action schema -> `Schema`: roles, conditions, effects as atoms over roles and constants
    start, goal -> sets of atoms (name, argument, ...)

What goes beyond STRIPS (`beyond` lists it) is refused by name. Every error is a `PddlError` of one
line: file, line, what is wrong, what to do. Where a domain declares no types, types that a problem
names all the same (some IPC blocks files do) are taken for `object`.

Costs are counted where the problem has (:metric minimize (total-cost)); no other metric is
understood. A cost is a whole number from 0 to 10^12, or a sum of functions of the action's
arguments that (:init ...) gives such numbers. A function that no action has as its cost is ignored,
whatever its numbers; a cost that (:init ...) does not give is no 0, but an error once an action
that can be carried out needs it (`grounding`).

The text is read here and not by a library: those at hand either refuse domains that planners accept
(names in capitals, costs without `:numeric-fluents`) or let undeclared predicates, wrong numbers of
arguments and unknown objects pass, and few of their errors name a file and a line.
"""

import pathlib

from sign_model.clock import NO_LIMIT, Clock
from sign_model.pddl.domain_reader import DomainReader
from sign_model.pddl.lifted import Domain, Problem
from sign_model.pddl.problem_reader import ProblemReader
from sign_model.pddl.syntax import read_source


def parse(
    domain: str | pathlib.Path, problem: str | pathlib.Path, *, clock: Clock = NO_LIMIT
) -> tuple[Domain, Problem]:
    """Returns the domain and the problem read from two paths (or texts); PddlError names file, line
    and rule.

    OutOfTime is raised once the time of `clock` has passed.
    """
    domain_text, domain_file = read_source(domain)
    problem_text, problem_file = read_source(problem)
    if domain_file == problem_file == "<text>":
        domain_file, problem_file = "<domain>", "<problem>"
    domain_reader = DomainReader(domain_text, domain_file, clock)
    problem_reader = ProblemReader(problem_text, problem_file, clock)
    lifted = domain_reader.read(problem_reader.object_names())
    return lifted, problem_reader.read(lifted)
