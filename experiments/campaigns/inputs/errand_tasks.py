"""Random planning tasks of errands, (domain, problem), from small ones up: cars on a ferry,
passengers of lifts, satellites that take pictures, crates that hoists stack in depots, doors that
keys open.
"""

import numpy as np

from experiments.campaigns.inputs.vehicle_tasks import (
    Pddl,
    both_ways,
    carried,
    network,
    objects,
    problem,
)

FERRY = """(define (domain crossing) (:requirements :strips :typing) (:types shore car)
 (:predicates (boat-at ?s - shore) (car-at ?c - car ?s - shore) (on-deck ?c - car) (deck-empty))
 (:action sail :parameters (?x ?y - shore)
  :precondition (boat-at ?x) :effect (and (boat-at ?y) (not (boat-at ?x))))
 (:action board :parameters (?c - car ?s - shore)
  :precondition (and (boat-at ?s) (car-at ?c ?s) (deck-empty))
  :effect (and (on-deck ?c) (not (car-at ?c ?s)) (not (deck-empty))))
 (:action debark :parameters (?c - car ?s - shore)
  :precondition (and (boat-at ?s) (on-deck ?c))
  :effect (and (car-at ?c ?s) (deck-empty) (not (on-deck ?c)))))"""

LIFTS = """(define (domain lifts) (:requirements :strips :typing) (:types floor person)
 (:predicates (above ?x ?y - floor) (lift-at ?x - floor) (waits ?p - person ?x - floor)
   (wants ?p - person ?x - floor) (inside ?p - person) (served ?p - person))
 (:action up :parameters (?x ?y - floor)
  :precondition (and (lift-at ?x) (above ?y ?x)) :effect (and (lift-at ?y) (not (lift-at ?x))))
 (:action down :parameters (?x ?y - floor)
  :precondition (and (lift-at ?x) (above ?x ?y)) :effect (and (lift-at ?y) (not (lift-at ?x))))
 (:action enter :parameters (?p - person ?x - floor)
  :precondition (and (lift-at ?x) (waits ?p ?x)) :effect (inside ?p))
 (:action leave :parameters (?p - person ?x - floor)
  :precondition (and (lift-at ?x) (inside ?p) (wants ?p ?x))
  :effect (and (served ?p) (not (inside ?p)))))"""

PICTURES = """(define (domain pictures) (:requirements :strips :typing)
 (:types satellite camera aim mode)
 (:predicates (carries ?s - satellite ?c - camera) (can ?c - camera ?m - mode)
   (points ?s - satellite ?a - aim) (power-left ?s - satellite) (is-on ?c - camera)
   (set-up ?c - camera) (reference ?c - camera ?a - aim) (have ?a - aim ?m - mode))
 (:action turn :parameters (?s - satellite ?a ?b - aim)
  :precondition (points ?s ?a) :effect (and (points ?s ?b) (not (points ?s ?a))))
 (:action start :parameters (?s - satellite ?c - camera)
  :precondition (and (carries ?s ?c) (power-left ?s))
  :effect (and (is-on ?c) (not (power-left ?s)) (not (set-up ?c))))
 (:action stop :parameters (?s - satellite ?c - camera)
  :precondition (and (carries ?s ?c) (is-on ?c)) :effect (and (power-left ?s) (not (is-on ?c))))
 (:action tune :parameters (?s - satellite ?c - camera ?a - aim)
  :precondition (and (carries ?s ?c) (is-on ?c) (reference ?c ?a) (points ?s ?a))
  :effect (set-up ?c))
 (:action take :parameters (?s - satellite ?c - camera ?a - aim ?m - mode)
  :precondition (and (carries ?s ?c) (is-on ?c) (set-up ?c) (can ?c ?m) (points ?s ?a))
  :effect (have ?a ?m)))"""

YARDS = """(define (domain yards) (:requirements :strips :typing)
 (:types yard truck hoist surface - object pallet crate - surface)
 (:predicates (in-yard ?h - hoist ?y - yard) (truck-at ?t - truck ?y - yard) (free ?h - hoist)
   (stands ?s - surface ?y - yard) (on ?c - crate ?s - surface) (top ?s - surface)
   (lifts ?h - hoist ?c - crate) (loaded ?c - crate ?t - truck))
 (:action go :parameters (?t - truck ?x ?y - yard)
  :precondition (truck-at ?t ?x) :effect (and (truck-at ?t ?y) (not (truck-at ?t ?x))))
 (:action lift :parameters (?h - hoist ?c - crate ?s - surface ?y - yard)
  :precondition (and (in-yard ?h ?y) (free ?h) (stands ?c ?y) (on ?c ?s) (top ?c))
  :effect (and (lifts ?h ?c) (top ?s) (not (free ?h)) (not (stands ?c ?y)) (not (on ?c ?s))
    (not (top ?c))))
 (:action put :parameters (?h - hoist ?c - crate ?s - surface ?y - yard)
  :precondition (and (in-yard ?h ?y) (lifts ?h ?c) (stands ?s ?y) (top ?s))
  :effect (and (free ?h) (stands ?c ?y) (on ?c ?s) (top ?c) (not (lifts ?h ?c)) (not (top ?s))))
 (:action load :parameters (?h - hoist ?c - crate ?t - truck ?y - yard)
  :precondition (and (in-yard ?h ?y) (truck-at ?t ?y) (lifts ?h ?c))
  :effect (and (loaded ?c ?t) (free ?h) (not (lifts ?h ?c))))
 (:action unload :parameters (?h - hoist ?c - crate ?t - truck ?y - yard)
  :precondition (and (in-yard ?h ?y) (truck-at ?t ?y) (free ?h) (loaded ?c ?t))
  :effect (and (lifts ?h ?c) (not (free ?h)) (not (loaded ?c ?t)))))"""

KEYS = """(define (domain keys) (:requirements :strips :typing) (:types cell key shape)
 (:predicates (next ?x ?y - cell) (at ?x - cell) (open ?x - cell) (lock ?x - cell ?s - shape)
   (lies ?k - key ?x - cell) (fits ?k - key ?s - shape) (holds ?k - key) (hand-free))
 (:action walk :parameters (?x ?y - cell)
  :precondition (and (at ?x) (next ?x ?y) (open ?y)) :effect (and (at ?y) (not (at ?x))))
 (:action take :parameters (?k - key ?x - cell)
  :precondition (and (at ?x) (lies ?k ?x) (hand-free))
  :effect (and (holds ?k) (not (lies ?k ?x)) (not (hand-free))))
 (:action lay :parameters (?k - key ?x - cell)
  :precondition (and (at ?x) (holds ?k)) :effect (and (lies ?k ?x) (hand-free) (not (holds ?k))))
 (:action unlock :parameters (?k - key ?s - shape ?x ?y - cell)
  :precondition (and (at ?x) (next ?x ?y) (lock ?y ?s) (fits ?k ?s) (holds ?k))
  :effect (and (open ?y) (not (lock ?y ?s)))))"""


def ferry(seed: int, shores: int, cars: int) -> Pddl:
    """A ferry with room for one car."""
    rng = np.random.default_rng(seed)
    boat = ["deck-empty", f"boat-at s{rng.integers(shores)}"]
    start, goal = carried(rng, "car-at c{} s{}", cars, shores)
    listed = objects({"shore": ("s", shores), "car": ("c", cars)})
    return FERRY, problem("crossing", listed, boat + start, goal)


def lifts(seed: int, floors: int, people: int) -> Pddl:
    """A lift of unlimited room, and people who wait."""
    rng = np.random.default_rng(seed)
    start = [f"above f{y} f{x}" for x in range(floors) for y in range(x + 1, floors)]
    start.append(f"lift-at f{rng.integers(floors)}")
    for person in range(people):
        here, there = rng.choice(floors, 2, replace=False)
        start += [f"waits p{person} f{here}", f"wants p{person} f{there}"]
    listed = objects({"floor": ("f", floors), "person": ("p", people)})
    return LIFTS, problem("lifts", listed, start, [f"served p{i}" for i in range(people)])


def pictures(seed: int, satellites: int, cameras: int, aims: int, wanted: int) -> Pddl:
    """Satellites whose cameras are started and tuned before they take pictures."""
    rng = np.random.default_rng(seed)
    modes, start = 2 + satellites // 2, []
    for i in range(satellites):
        start += [f"points s{i} a{rng.integers(aims)}", f"power-left s{i}"]
    for i in range(cameras):
        able = rng.choice(modes, 1 + i % 2, replace=False)
        start += [f"carries s{i % satellites} c{i}", f"reference c{i} a{rng.integers(aims)}"]
        start += [f"can c{i} m{m}" for m in sorted({i % modes, *able.tolist()})]
    pairs = rng.permutation(aims * min(modes, cameras))[:wanted]
    goal = [f"have a{pair % aims} m{pair // aims}" for pair in sorted(pairs.tolist())]
    counts = {"satellite": ("s", satellites), "camera": ("c", cameras)}
    counts |= {"aim": ("a", aims), "mode": ("m", modes)}
    return PICTURES, problem("pictures", objects(counts), start, goal)


def yards(seed: int, num_yards: int, trucks: int, pallets: int, crates: int) -> Pddl:
    """Crates in stacks, a hoist in every yard, trucks between them; every yard has pallets."""
    rng = np.random.default_rng(seed)
    start = [f"in-yard h{i} y{i}" for i in range(num_yards)]
    start += [f"free h{i}" for i in range(num_yards)]
    start += [f"truck-at t{i} y{rng.integers(num_yards)}" for i in range(trucks)]
    start += [f"stands p{i} y{i % num_yards}" for i in range(pallets)]
    goal = []
    for facts in (start, goal):  # crates in a random order, each on a random stack
        tops = {i: f"p{i}" for i in range(pallets)}
        for crate in rng.permutation(crates).tolist():
            stack = int(rng.integers(pallets))
            facts.append(f"on c{crate} {tops[stack]}")
            if facts is start:
                facts.append(f"stands c{crate} y{stack % num_yards}")
            tops[stack] = f"c{crate}"
        if facts is start:
            facts += [f"top {name}" for name in tops.values()]
    counts = {"yard": ("y", num_yards), "truck": ("t", trucks), "hoist": ("h", num_yards)}
    listed = objects(counts | {"pallet": ("p", pallets), "crate": ("c", crates)})
    return YARDS, problem("yards", listed, start, goal)


def keys(seed: int, cells: int, locked: int, shapes: int, moved: int) -> Pddl:
    """Keys that open doors and belong elsewhere; one is carried at a time. The last cells are
    locked, and every key lies before them.
    """
    rng = np.random.default_rng(seed)
    pairs = sorted(network(rng, list(range(cells))))
    start = both_ways("next x{} x{}", pairs)
    start += ["at x0", "hand-free"]
    start += [f"open x{i}" for i in range(cells - locked)]
    start += [f"lock x{i} s{i % shapes}" for i in range(cells - locked, cells)]
    num_keys = max(shapes, moved)
    start += [f"fits k{i} s{i % shapes}" for i in range(num_keys)]
    start += [f"lies k{i} x{rng.integers(cells - locked)}" for i in range(num_keys)]
    goal = [f"lies k{i} x{rng.integers(cells)}" for i in range(moved)]
    counts = {"cell": ("x", cells), "key": ("k", num_keys), "shape": ("s", shapes)}
    return KEYS, problem("keys", objects(counts), start, goal)
