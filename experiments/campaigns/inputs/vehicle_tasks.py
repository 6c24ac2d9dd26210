"""Random planning tasks of vehicles and hands, {name: (domain, problem)}, from small ones up to
those of competitions: roads with trucks, cities with planes, deliveries of limited room, rooms with
two-handed robots.
"""

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

Pddl = tuple[str, str]

ROADS = """(define (domain roads) (:requirements :strips :typing)
 (:types place room - object truck parcel - movable movable - object)
 (:predicates (road ?p ?q - place) (at ?m - movable ?p - place) (aboard ?x - parcel ?t - truck)
   (room-left ?t - truck ?r - room) (one-less ?r ?s - room))
 (:action go :parameters (?t - truck ?p ?q - place)
  :precondition (and (at ?t ?p) (road ?p ?q)) :effect (and (at ?t ?q) (not (at ?t ?p))))
 (:action collect :parameters (?t - truck ?p - place ?x - parcel ?r ?s - room)
  :precondition (and (at ?t ?p) (at ?x ?p) (room-left ?t ?s) (one-less ?r ?s))
  :effect (and (aboard ?x ?t) (room-left ?t ?r) (not (at ?x ?p)) (not (room-left ?t ?s))))
 (:action deliver :parameters (?t - truck ?p - place ?x - parcel ?r ?s - room)
  :precondition (and (at ?t ?p) (aboard ?x ?t) (room-left ?t ?r) (one-less ?r ?s))
  :effect (and (at ?x ?p) (room-left ?t ?s) (not (aboard ?x ?t)) (not (room-left ?t ?r)))))"""

AIRLINES = """(define (domain airlines) (:requirements :strips :typing)
 (:types spot city - object airport - spot truck plane - carrier carrier parcel - thing)
 (:predicates (at ?x - thing ?p - spot) (inside ?x - parcel ?v - carrier)
   (part ?p - spot ?c - city))
 (:action put-in :parameters (?x - parcel ?v - carrier ?p - spot)
  :precondition (and (at ?x ?p) (at ?v ?p)) :effect (and (inside ?x ?v) (not (at ?x ?p))))
 (:action take-out :parameters (?x - parcel ?v - carrier ?p - spot)
  :precondition (and (inside ?x ?v) (at ?v ?p)) :effect (and (at ?x ?p) (not (inside ?x ?v))))
 (:action ride :parameters (?t - truck ?p ?q - spot ?c - city)
  :precondition (and (at ?t ?p) (part ?p ?c) (part ?q ?c))
  :effect (and (at ?t ?q) (not (at ?t ?p))))
 (:action wing :parameters (?a - plane ?p ?q - airport)
  :precondition (at ?a ?p) :effect (and (at ?a ?q) (not (at ?a ?p)))))"""

ROOMS = """(define (domain rooms) (:requirements :strips :typing) (:types room ball robot hand)
 (:predicates (stands ?r - robot ?x - room) (lies ?b - ball ?x - room) (empty ?h - hand)
   (grips ?h - hand ?b - ball) (hand-of ?h - hand ?r - robot) (door ?x ?y - room))
 (:action step :parameters (?r - robot ?x ?y - room)
  :precondition (and (stands ?r ?x) (door ?x ?y)) :effect (and (stands ?r ?y) (not (stands ?r ?x))))
 (:action grab :parameters (?b - ball ?x - room ?r - robot ?h - hand)
  :precondition (and (lies ?b ?x) (stands ?r ?x) (hand-of ?h ?r) (empty ?h))
  :effect (and (grips ?h ?b) (not (lies ?b ?x)) (not (empty ?h))))
 (:action drop :parameters (?b - ball ?x - room ?r - robot ?h - hand)
  :precondition (and (grips ?h ?b) (stands ?r ?x) (hand-of ?h ?r))
  :effect (and (lies ?b ?x) (empty ?h) (not (grips ?h ?b)))))"""


def carried(
    rng: np.random.Generator, form: str, count: int, places: int
) -> tuple[list[str], list[str]]:
    """Returns where things are at first and at last, two places each, as facts of a form such as
    "at x{} p{}".
    """
    start, goal = [], []
    for thing in range(count):
        here, there = rng.choice(places, 2, replace=False)
        start.append(form.format(thing, here))
        goal.append(form.format(thing, there))
    return start, goal


def both_ways(form: str, pairs: Iterable[tuple[int, int]]) -> list[str]:
    """Returns facts of a form such as "road p{} p{}" that join the places of each pair."""
    return [form.format(*ends) for pair in pairs for ends in (pair, pair[::-1])]


def roads(
    seed: int, places: int, trucks: int, parcels: int, *, capacity: int = 3, cities: int = 1
) -> Pddl:
    """Trucks of limited room on a network of roads; with several cities, each a network of its own
    joined by single roads."""
    rng = np.random.default_rng(seed)
    joined: set[tuple[int, int]] = set()
    for city in range(cities):
        own = [p for p in range(places) if p % cities == city]
        joined |= network(rng, own)
        if city:
            joined.add((int(rng.choice(own)), int(rng.integers(0, city))))
    start = [f"road p{a} p{b}" for a, b in sorted(joined)]
    start += [f"road p{b} p{a}" for a, b in sorted(joined)]
    start += [f"one-less r{i} r{i + 1}" for i in range(capacity)]
    for truck in range(trucks):
        room = capacity if truck % 2 == 0 else max(1, capacity - 1)
        start += [f"at t{truck} p{rng.integers(places)}", f"room-left t{truck} r{room}"]
    lies, goal = carried(rng, "at x{} p{}", parcels, places)
    counts = {"place": ("p", places), "truck": ("t", trucks), "parcel": ("x", parcels)}
    return ROADS, problem(
        "roads", objects(counts | {"room": ("r", capacity + 1)}), start + lies, goal
    )


def airlines(seed: int, cities: int, spots: int, parcels: int, planes: int) -> Pddl:
    """Trucks within cities, planes between their airports."""
    rng = np.random.default_rng(seed)
    names = [[f"a{c}", *(f"s{c}_{i}" for i in range(1, spots))] for c in range(cities)]
    start = [f"part {spot} c{c}" for c, own in enumerate(names) for spot in own]
    start += [f"at t{c} {rng.choice(own)}" for c, own in enumerate(names)]
    start += [f"at f{i} a{rng.integers(cities)}" for i in range(planes)]
    every, goal = [spot for own in names for spot in own], []
    for parcel in range(parcels):
        here, there = rng.choice(len(every), 2, replace=False)
        start.append(f"at x{parcel} {every[here]}")
        goal.append(f"at x{parcel} {every[there]}")
    others = [spot for own in names for spot in own[1:]]
    counts = {"city": ("c", cities), "airport": ("a", cities), "truck": ("t", cities)}
    listed = objects(counts | {"plane": ("f", planes), "parcel": ("x", parcels)})
    spots_listed = f" {' '.join(others)} - spot" if others else ""
    return AIRLINES, problem("airlines", listed + spots_listed, start, goal)


def rooms(seed: int, num_rooms: int, balls: int, robots: int) -> Pddl:
    """Robots with two hands carry balls between rooms; two rooms and one robot: all balls start in
    one and belong in the other."""
    rng = np.random.default_rng(seed)
    doors = network(rng, list(range(num_rooms)))
    start = [f"door r{a} r{b}" for a, b in sorted(doors)]
    start += [f"door r{b} r{a}" for a, b in sorted(doors)]
    for robot in range(robots):
        start.append(f"stands k{robot} r0")
        for hand in (2 * robot, 2 * robot + 1):
            start += [f"hand-of h{hand} k{robot}", f"empty h{hand}"]
    goal = []
    for ball in range(balls):
        pair = (0, 1) if num_rooms == 2 else rng.choice(num_rooms, 2, replace=False)
        start.append(f"lies b{ball} r{pair[0]}")
        goal.append(f"lies b{ball} r{pair[1]}")
    counts = {"room": ("r", num_rooms), "ball": ("b", balls), "robot": ("k", robots)}
    return ROOMS, problem("rooms", objects(counts | {"hand": ("h", 2 * robots)}), start, goal)


def vehicle_tasks() -> Iterator[tuple[str, Pddl]]:
    """Yields the series, (name, (domain, problem)) each, every one from small to large."""
    sizes: Sequence[tuple[int, ...]]
    sizes = (
        (5, 2, 2, 1),
        (10, 2, 4, 1),
        (12, 2, 6, 1),
        (16, 3, 8, 2),
        (20, 3, 9, 1),
        (24, 3, 12, 2),
        (30, 4, 12, 1),
        (36, 4, 15, 3),
        (50, 4, 18, 1),
        (66, 4, 20, 3),
    )
    for i, (places, trucks, parcels, cities) in enumerate(sizes):
        yield f"transport-{i + 1}", roads(i, places, trucks, parcels, cities=cities)
    for i, (places, trucks, parcels) in enumerate(
        ((6, 1, 3), (8, 1, 5), (10, 2, 6), (15, 2, 5), (15, 2, 8), (20, 3, 10), (25, 2, 12))
    ):
        yield f"delivery-{i + 1}", roads(100 + i, places, trucks, parcels, capacity=2 + i % 2)
    sizes = (
        (2, 2, 3, 1),
        (2, 3, 6, 1),
        (3, 3, 8, 1),
        (4, 3, 10, 2),
        (5, 3, 14, 2),
        (6, 4, 18, 2),
        (8, 4, 22, 3),
        (10, 5, 26, 3),
        (14, 5, 30, 4),
        (20, 4, 40, 5),
    )
    for i, (cities, spots, parcels, planes) in enumerate(sizes):
        yield f"logistics-{i + 1}", airlines(i, cities, spots, parcels, planes)
    for i, balls in enumerate((4, 6, 10, 16, 20, 28, 36, 42)):
        yield f"hands-{i + 1}", rooms(i, 2, balls, 1)
    for i, (places, balls, robots) in enumerate(
        ((3, 5, 1), (4, 8, 2), (6, 12, 2), (8, 16, 3), (10, 20, 3), (12, 30, 4))
    ):
        yield f"rooms-{i + 1}", rooms(50 + i, places, balls, robots)


def network(rng: np.random.Generator, nodes: list[int]) -> set[tuple[int, int]]:
    """Returns pairs that join all nodes: a random tree and half as many more."""
    pairs = set()
    for i in range(1, len(nodes)):
        pairs.add((nodes[i], nodes[int(rng.integers(max(0, i - 6), i))]))
    for _ in range(len(nodes) // 2):
        one, other = rng.choice(len(nodes), 2, replace=False)
        if (nodes[other], nodes[one]) not in pairs:
            pairs.add((nodes[one], nodes[other]))
    return pairs


def objects(counts: dict[str, tuple[str, int]]) -> str:
    """Returns the objects of a problem from {type: (prefix, how many)}."""
    return " ".join(
        f"{' '.join(f'{prefix}{i}' for i in range(count))} - {kind}"
        for kind, (prefix, count) in counts.items()
        if count
    )


def problem(domain: str, listed: str, start: Sequence[str], goal: Sequence[str]) -> str:
    """Returns a problem in PDDL from its objects and the facts of start and goal."""
    held, wanted = (" ".join(f"({fact})" for fact in facts) for facts in (start, goal))
    return (
        f"(define (problem random) (:domain {domain}) (:objects {listed}) (:init {held})"
        f" (:goal (and {wanted})))"
    )
