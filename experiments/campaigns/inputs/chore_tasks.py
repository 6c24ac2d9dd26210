"""Random planning tasks of chores, (domain, problem), from small ones up: plants that are watered,
boards that are painted, wagons that are shunted. Written as a hold-out for what was chosen on other
series.
"""

import numpy as np

from experiments.campaigns.inputs.vehicle_tasks import Pddl, both_ways, network, objects, problem

GARDEN = """(define (domain garden) (:requirements :strips :typing) (:types bed can amount)
 (:predicates (path ?x ?y - bed) (here ?x - bed) (tap ?x - bed) (stands ?c - can ?x - bed)
   (carries ?c - can) (hands-free) (full ?c - can) (needs ?x - bed ?n - amount)
   (less ?m ?n - amount))
 (:action walk :parameters (?x ?y - bed)
  :precondition (and (here ?x) (path ?x ?y)) :effect (and (here ?y) (not (here ?x))))
 (:action lift :parameters (?c - can ?x - bed)
  :precondition (and (here ?x) (stands ?c ?x) (hands-free))
  :effect (and (carries ?c) (not (stands ?c ?x)) (not (hands-free))))
 (:action set-down :parameters (?c - can ?x - bed)
  :precondition (and (here ?x) (carries ?c))
  :effect (and (stands ?c ?x) (hands-free) (not (carries ?c))))
 (:action fill :parameters (?c - can ?x - bed)
  :precondition (and (here ?x) (tap ?x) (carries ?c)) :effect (full ?c))
 (:action pour :parameters (?c - can ?x - bed ?m ?n - amount)
  :precondition (and (here ?x) (carries ?c) (full ?c) (needs ?x ?n) (less ?m ?n))
  :effect (and (needs ?x ?m) (not (needs ?x ?n)) (not (full ?c)))))"""

PAINT = """(define (domain paint) (:requirements :strips :typing) (:types board brush colour place)
 (:predicates (lies ?b - board ?p - place) (holds ?r - brush) (free-hand)
   (wet ?r - brush ?c - colour) (clean ?r - brush) (at ?p - place) (pot ?c - colour ?p - place)
   (basin ?p - place) (painted ?b - board ?c - colour) (bare ?b - board)
   (primer ?c - colour) (primed ?b - board))
 (:action go :parameters (?p ?q - place) :precondition (at ?p) :effect (and (at ?q) (not (at ?p))))
 (:action pick :parameters (?r - brush)
  :precondition (free-hand) :effect (and (holds ?r) (not (free-hand))))
 (:action drop :parameters (?r - brush)
  :precondition (holds ?r) :effect (and (free-hand) (not (holds ?r))))
 (:action dip :parameters (?r - brush ?c - colour ?p - place)
  :precondition (and (holds ?r) (clean ?r) (at ?p) (pot ?c ?p))
  :effect (and (wet ?r ?c) (not (clean ?r))))
 (:action wash :parameters (?r - brush ?c - colour ?p - place)
  :precondition (and (holds ?r) (wet ?r ?c) (at ?p) (basin ?p))
  :effect (and (clean ?r) (not (wet ?r ?c))))
 (:action prime :parameters (?b - board ?r - brush ?c - colour ?p - place)
  :precondition (and (lies ?b ?p) (at ?p) (holds ?r) (wet ?r ?c) (primer ?c) (bare ?b))
  :effect (and (primed ?b) (not (bare ?b))))
 (:action coat :parameters (?b - board ?r - brush ?c - colour ?p - place)
  :precondition (and (lies ?b ?p) (at ?p) (holds ?r) (wet ?r ?c) (primed ?b))
  :effect (and (painted ?b ?c) (not (primed ?b)))))"""

RAILS = """(define (domain rails) (:requirements :strips :typing)
 (:types track part - object engine wagon - part)
 (:predicates (joined ?x ?y - track) (on-track ?e - engine ?x - track)
   (behind ?w - wagon ?p - part) (last ?p - part) (waits ?w - wagon ?x - track) (empty ?x - track))
 (:action run :parameters (?e - engine ?x ?y - track)
  :precondition (and (on-track ?e ?x) (joined ?x ?y))
  :effect (and (on-track ?e ?y) (not (on-track ?e ?x))))
 (:action couple :parameters (?e - engine ?w - wagon ?x - track)
  :precondition (and (on-track ?e ?x) (waits ?w ?x) (last ?e))
  :effect (and (behind ?w ?e) (last ?w) (empty ?x) (not (waits ?w ?x)) (not (last ?e))))
 (:action append :parameters (?e - engine ?v ?w - wagon ?x - track)
  :precondition (and (on-track ?e ?x) (waits ?w ?x) (behind ?v ?e) (last ?v))
  :effect (and (behind ?w ?v) (last ?w) (empty ?x) (not (waits ?w ?x)) (not (last ?v))))
 (:action drop-first :parameters (?e - engine ?w - wagon ?x - track)
  :precondition (and (on-track ?e ?x) (behind ?w ?e) (last ?w) (empty ?x))
  :effect (and (waits ?w ?x) (last ?e) (not (behind ?w ?e)) (not (last ?w)) (not (empty ?x))))
 (:action drop-second :parameters (?e - engine ?v ?w - wagon ?x - track)
  :precondition (and (on-track ?e ?x) (behind ?v ?e) (behind ?w ?v) (last ?w) (empty ?x))
  :effect (and (waits ?w ?x) (last ?v) (not (behind ?w ?v)) (not (last ?w)) (not (empty ?x)))))"""


def garden(seed: int, beds: int, cans: int, thirsty: int) -> Pddl:
    """Beds joined by paths, a tap, cans that hold one pour, beds that need one or two."""
    rng = np.random.default_rng(seed)
    pairs = sorted(network(rng, list(range(beds))))
    start = both_ways("path b{} b{}", pairs)
    start += ["less n0 n1", "less n1 n2", "hands-free", f"here b{rng.integers(beds)}"]
    start.append(f"tap b{rng.integers(beds)}")
    start += [f"stands c{i} b{rng.integers(beds)}" for i in range(cans)]
    chosen = sorted(rng.choice(beds, min(thirsty, beds), replace=False).tolist())
    start += [f"needs b{bed} n{1 + rng.integers(2)}" for bed in chosen]
    counts = {"bed": ("b", beds), "can": ("c", cans), "amount": ("n", 3)}
    goal = [f"needs b{bed} n0" for bed in chosen]
    return GARDEN, problem("garden", objects(counts), start, goal)


def paint(seed: int, boards: int, brushes: int, colours: int) -> Pddl:
    """Boards in several places, primed and then painted; a brush is washed between colours."""
    rng = np.random.default_rng(seed)
    places = 2 + boards // 3
    start = ["free-hand", f"at p{rng.integers(places)}", "primer k0", "basin p0"]
    start += [f"clean r{i}" for i in range(brushes)]
    start += [f"pot k{i} p{i % places}" for i in range(colours + 1)]
    goal = []
    for board in range(boards):
        start += [f"lies b{board} p{rng.integers(places)}", f"bare b{board}"]
        goal.append(f"painted b{board} k{1 + rng.integers(colours)}")
    counts = {"board": ("b", boards), "brush": ("r", brushes), "colour": ("k", colours + 1)}
    return PAINT, problem("paint", objects(counts | {"place": ("p", places)}), start, goal)


def rails(seed: int, tracks: int, wagons: int) -> Pddl:
    """An engine that draws two wagons at most, and tracks that hold one each."""
    rng = np.random.default_rng(seed)
    pairs = sorted(network(rng, list(range(tracks))))
    start = both_ways("joined x{} x{}", pairs)
    start += [f"on-track e0 x{rng.integers(tracks)}", "last e0"]
    here, there = (rng.choice(tracks, wagons, replace=False).tolist() for _ in range(2))
    start += [f"waits w{i} x{at}" for i, at in enumerate(here)]
    start += [f"empty x{at}" for at in sorted(set(range(tracks)) - set(here))]
    counts = {"track": ("x", tracks), "engine": ("e", 1), "wagon": ("w", wagons)}
    goal = [f"waits w{i} x{at}" for i, at in enumerate(there)]
    return RAILS, problem("rails", objects(counts), start, goal)
