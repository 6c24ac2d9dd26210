"""Random planning tasks of trades, (domain, problem), from small ones up: letters handed from one
courier to another, drones that have to be charged, dishes cooked in few pots. Written as a second
hold-out for what was chosen on other series.
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

COURIERS = """(define (domain couriers) (:requirements :strips :typing)
 (:types corner courier letter)
 (:predicates (street ?x ?y - corner) (beat ?c - courier ?x - corner)
   (stands ?c - courier ?x - corner) (lies ?l - letter ?x - corner)
   (bears ?c - courier ?l - letter) (empty-handed ?c - courier))
 (:action stroll :parameters (?c - courier ?x ?y - corner)
  :precondition (and (stands ?c ?x) (street ?x ?y) (beat ?c ?y))
  :effect (and (stands ?c ?y) (not (stands ?c ?x))))
 (:action take :parameters (?c - courier ?l - letter ?x - corner)
  :precondition (and (stands ?c ?x) (lies ?l ?x) (empty-handed ?c))
  :effect (and (bears ?c ?l) (not (lies ?l ?x)) (not (empty-handed ?c))))
 (:action leave :parameters (?c - courier ?l - letter ?x - corner)
  :precondition (and (stands ?c ?x) (bears ?c ?l))
  :effect (and (lies ?l ?x) (empty-handed ?c) (not (bears ?c ?l))))
 (:action hand-over :parameters (?c ?d - courier ?l - letter ?x - corner)
  :precondition (and (stands ?c ?x) (stands ?d ?x) (bears ?c ?l) (empty-handed ?d))
  :effect (and (bears ?d ?l) (empty-handed ?c) (not (bears ?c ?l)) (not (empty-handed ?d)))))"""

DRONES = """(define (domain drones) (:requirements :strips :typing)
 (:types roof drone box charge)
 (:predicates (near ?x ?y - roof) (hovers ?d - drone ?x - roof) (left ?d - drone ?n - charge)
   (less ?m ?n - charge) (full ?n - charge) (socket ?x - roof) (lies ?b - box ?x - roof)
   (hooked ?d - drone ?b - box) (bare ?d - drone))
 (:action fly :parameters (?d - drone ?x ?y - roof ?m ?n - charge)
  :precondition (and (hovers ?d ?x) (near ?x ?y) (left ?d ?n) (less ?m ?n))
  :effect (and (hovers ?d ?y) (left ?d ?m) (not (hovers ?d ?x)) (not (left ?d ?n))))
 (:action charge :parameters (?d - drone ?x - roof ?m ?n - charge)
  :precondition (and (hovers ?d ?x) (socket ?x) (left ?d ?m) (full ?n))
  :effect (and (left ?d ?n) (not (left ?d ?m))))
 (:action hook :parameters (?d - drone ?b - box ?x - roof)
  :precondition (and (hovers ?d ?x) (lies ?b ?x) (bare ?d))
  :effect (and (hooked ?d ?b) (not (lies ?b ?x)) (not (bare ?d))))
 (:action release :parameters (?d - drone ?b - box ?x - roof)
  :precondition (and (hovers ?d ?x) (hooked ?d ?b))
  :effect (and (lies ?b ?x) (bare ?d) (not (hooked ?d ?b)))))"""

KITCHEN = """(define (domain kitchen) (:requirements :strips :typing) (:types dish pot burner plate)
 (:predicates (raw ?d - dish) (clean ?p - pot) (dirty ?p - pot) (idle ?p - pot)
   (holds ?p - pot ?d - dish) (free ?b - burner) (on ?p - pot ?b - burner) (cooked ?d - dish)
   (blank ?a - plate) (served ?d - dish) (sauce-first ?d ?e - dish) (plain ?d - dish))
 (:action fill :parameters (?d - dish ?p - pot)
  :precondition (and (raw ?d) (clean ?p) (idle ?p))
  :effect (and (holds ?p ?d) (not (raw ?d)) (not (clean ?p))))
 (:action put-on :parameters (?p - pot ?b - burner)
  :precondition (and (idle ?p) (free ?b)) :effect (and (on ?p ?b) (not (idle ?p)) (not (free ?b))))
 (:action take-off :parameters (?p - pot ?b - burner)
  :precondition (on ?p ?b) :effect (and (idle ?p) (free ?b) (not (on ?p ?b))))
 (:action cook :parameters (?d - dish ?p - pot ?b - burner)
  :precondition (and (holds ?p ?d) (on ?p ?b) (plain ?d)) :effect (cooked ?d))
 (:action cook-in-sauce :parameters (?d ?e - dish ?p - pot ?b - burner)
  :precondition (and (holds ?p ?d) (on ?p ?b) (sauce-first ?e ?d) (served ?e)) :effect (cooked ?d))
 (:action serve :parameters (?d - dish ?p - pot ?a - plate)
  :precondition (and (holds ?p ?d) (cooked ?d) (idle ?p) (blank ?a))
  :effect (and (served ?d) (dirty ?p) (not (holds ?p ?d)) (not (blank ?a))))
 (:action rinse :parameters (?p - pot)
  :precondition (and (dirty ?p) (idle ?p)) :effect (and (clean ?p) (not (dirty ?p)))))"""


def couriers(seed: int, corners: int, couriers: int, letters: int) -> Pddl:
    """Couriers whose beats overlap, so that letters go from hand to hand."""
    rng = np.random.default_rng(seed)
    pairs = sorted(network(rng, list(range(corners))))
    start = both_ways("street x{} x{}", pairs)
    share = -(-corners // couriers)
    for i in range(couriers):
        own = set(range(max(0, i * share - 2), min(corners, (i + 1) * share + 1)))
        own |= set(range(corners)) if couriers == 1 or i == couriers - 1 else set()
        start += [f"beat c{i} x{corner}" for corner in sorted(own)]
        start += [f"stands c{i} x{rng.choice(sorted(own))}", f"empty-handed c{i}"]
    lies, goal = carried(rng, "lies l{} x{}", letters, corners)
    counts = {"corner": ("x", corners), "courier": ("c", couriers), "letter": ("l", letters)}
    return COURIERS, problem("couriers", objects(counts), start + lies, goal)


def drones(seed: int, roofs: int, drones: int, boxes: int) -> Pddl:
    """Drones that fly five times on one charge, and carry one box each."""
    rng = np.random.default_rng(seed)
    pairs = sorted(network(rng, list(range(roofs))))
    start = both_ways("near x{} x{}", pairs)
    start += ["full n5", *(f"less n{i} n{i + 1}" for i in range(5))]
    start += [f"socket x{i}" for i in range(0, roofs, 3)]
    for i in range(drones):
        start += [f"hovers d{i} x{rng.integers(roofs)}", f"left d{i} n5", f"bare d{i}"]
    lies, goal = carried(rng, "lies b{} x{}", boxes, roofs)
    counts = {"roof": ("x", roofs), "drone": ("d", drones), "box": ("b", boxes)}
    return DRONES, problem("drones", objects(counts | {"charge": ("n", 6)}), start + lies, goal)


def kitchen(seed: int, dishes: int, pots: int, burners: int) -> Pddl:
    """Dishes cooked in few pots on few burners; some wait for another that is served first."""
    rng = np.random.default_rng(seed)
    start = [f"clean p{i}" for i in range(pots)] + [f"idle p{i}" for i in range(pots)]
    start += [f"free b{i}" for i in range(burners)] + [f"blank a{i}" for i in range(dishes)]
    for i in range(dishes):
        waits = i > 0 and rng.random() < 0.4
        start += [f"raw d{i}", f"sauce-first d{rng.integers(i)} d{i}" if waits else f"plain d{i}"]
    counts = {"dish": ("d", dishes), "pot": ("p", pots), "burner": ("b", burners)}
    goal = [f"served d{i}" for i in range(dishes)]
    return KITCHEN, problem("kitchen", objects(counts | {"plate": ("a", dishes)}), start, goal)
