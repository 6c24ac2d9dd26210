"""Random planning tasks of workshops, {name: (domain, problem)}, from small ones up to those of
competitions: sandwiches on trays, orders that wait for products, cocktails in a shaker.
"""

from collections.abc import Iterator

import numpy as np

from experiments.campaigns.inputs.vehicle_tasks import Pddl, objects, problem

SNACKS = """(define (domain snacks) (:requirements :strips :typing)
 (:types child bread filling tray sandwich table)
 (:constants kitchen - table)
 (:predicates (bread-left ?b - bread) (filling-left ?f - filling) (pure-bread ?b - bread)
   (pure-filling ?f - filling) (allergic ?c - child) (eats-all ?c - child)
   (made-here ?s - sandwich) (on-tray ?s - sandwich ?t - tray) (pure ?s - sandwich)
   (unmade ?s - sandwich) (sits ?c - child ?x - table) (tray-at ?t - tray ?x - table)
   (fed ?c - child))
 (:action make-pure :parameters (?s - sandwich ?b - bread ?f - filling)
  :precondition (and (bread-left ?b) (filling-left ?f) (pure-bread ?b) (pure-filling ?f)
    (unmade ?s))
  :effect (and (made-here ?s) (pure ?s) (not (bread-left ?b)) (not (filling-left ?f))
    (not (unmade ?s))))
 (:action make :parameters (?s - sandwich ?b - bread ?f - filling)
  :precondition (and (bread-left ?b) (filling-left ?f) (unmade ?s))
  :effect (and (made-here ?s) (not (bread-left ?b)) (not (filling-left ?f)) (not (unmade ?s))))
 (:action lay :parameters (?s - sandwich ?t - tray)
  :precondition (and (made-here ?s) (tray-at ?t kitchen))
  :effect (and (on-tray ?s ?t) (not (made-here ?s))))
 (:action feed-pure :parameters (?s - sandwich ?c - child ?t - tray ?x - table)
  :precondition (and (allergic ?c) (on-tray ?s ?t) (sits ?c ?x) (pure ?s) (tray-at ?t ?x))
  :effect (and (fed ?c) (not (on-tray ?s ?t))))
 (:action feed :parameters (?s - sandwich ?c - child ?t - tray ?x - table)
  :precondition (and (eats-all ?c) (sits ?c ?x) (on-tray ?s ?t) (tray-at ?t ?x))
  :effect (and (fed ?c) (not (on-tray ?s ?t))))
 (:action carry :parameters (?t - tray ?x ?y - table)
  :precondition (tray-at ?t ?x) :effect (and (tray-at ?t ?y) (not (tray-at ?t ?x)))))"""

BAR = """(define (domain bar) (:requirements :strips :typing)
 (:types hand fill tap drink vessel - object juice cocktail - drink glass shaker - vessel)
 (:predicates (on-bar ?v - vessel) (holds ?h - hand ?v - vessel) (idle ?h - hand)
   (gives ?d - tap ?j - juice) (blank ?v - vessel) (has ?v - vessel ?d - drink)
   (clean ?v - vessel) (stained ?v - vessel ?d - drink) (empty-fill ?s - shaker ?l - fill)
   (fill-at ?s - shaker ?l - fill) (more ?l ?m - fill) (unmixed ?s - shaker) (mixed ?s - shaker)
   (first-part ?c - cocktail ?j - juice) (second-part ?c - cocktail ?j - juice))
 (:action lift :parameters (?h - hand ?v - vessel)
  :precondition (and (on-bar ?v) (idle ?h))
  :effect (and (holds ?h ?v) (not (on-bar ?v)) (not (idle ?h))))
 (:action stand :parameters (?h - hand ?v - vessel)
  :precondition (holds ?h ?v) :effect (and (idle ?h) (on-bar ?v) (not (holds ?h ?v))))
 (:action tap-glass :parameters (?g - glass ?j - juice ?h ?k - hand ?d - tap)
  :precondition (and (holds ?h ?g) (idle ?k) (gives ?d ?j) (blank ?g) (clean ?g))
  :effect (and (has ?g ?j) (stained ?g ?j) (not (blank ?g)) (not (clean ?g))))
 (:action tap-again :parameters (?g - glass ?j - juice ?h ?k - hand ?d - tap)
  :precondition (and (holds ?h ?g) (idle ?k) (gives ?d ?j) (blank ?g) (stained ?g ?j))
  :effect (and (has ?g ?j) (not (blank ?g))))
 (:action rinse-glass :parameters (?g - glass ?d - drink ?h ?k - hand)
  :precondition (and (holds ?h ?g) (idle ?k) (blank ?g) (stained ?g ?d))
  :effect (and (clean ?g) (not (stained ?g ?d))))
 (:action spill :parameters (?h - hand ?g - glass ?d - drink)
  :precondition (and (holds ?h ?g) (has ?g ?d)) :effect (and (blank ?g) (not (has ?g ?d))))
 (:action pour-first :parameters (?g - glass ?j - juice ?s - shaker ?h - hand ?l ?m - fill)
  :precondition (and (holds ?h ?g) (has ?g ?j) (blank ?s) (clean ?s) (fill-at ?s ?l) (more ?l ?m))
  :effect (and (blank ?g) (has ?s ?j) (unmixed ?s) (fill-at ?s ?m) (not (has ?g ?j))
    (not (blank ?s)) (not (clean ?s)) (not (fill-at ?s ?l))))
 (:action pour-more :parameters (?g - glass ?j - juice ?s - shaker ?h - hand ?l ?m - fill)
  :precondition (and (holds ?h ?g) (has ?g ?j) (unmixed ?s) (fill-at ?s ?l) (more ?l ?m))
  :effect (and (blank ?g) (has ?s ?j) (fill-at ?s ?m) (not (has ?g ?j)) (not (fill-at ?s ?l))))
 (:action empty-shaker :parameters (?h - hand ?s - shaker ?c - cocktail ?l ?m - fill)
  :precondition (and (holds ?h ?s) (has ?s ?c) (mixed ?s) (fill-at ?s ?l) (empty-fill ?s ?m))
  :effect (and (blank ?s) (fill-at ?s ?m) (not (has ?s ?c)) (not (mixed ?s))
    (not (fill-at ?s ?l))))
 (:action rinse-shaker :parameters (?h ?k - hand ?s - shaker)
  :precondition (and (holds ?h ?s) (idle ?k) (blank ?s)) :effect (clean ?s))
 (:action shake :parameters (?c - cocktail ?i ?j - juice ?s - shaker ?h ?k - hand)
  :precondition (and (holds ?h ?s) (idle ?k) (has ?s ?i) (has ?s ?j) (first-part ?c ?i)
    (second-part ?c ?j) (unmixed ?s))
  :effect (and (mixed ?s) (has ?s ?c) (not (unmixed ?s)) (not (has ?s ?i)) (not (has ?s ?j))))
 (:action serve :parameters (?d - drink ?g - glass ?h - hand ?s - shaker ?l ?m - fill)
  :precondition (and (holds ?h ?s) (has ?s ?d) (mixed ?s) (blank ?g) (clean ?g) (fill-at ?s ?l)
    (more ?m ?l))
  :effect (and (has ?g ?d) (fill-at ?s ?m) (not (clean ?g)) (not (blank ?g))
    (not (fill-at ?s ?l)))))"""


def snacks(seed: int, children: int, trays: int, tables: int) -> Pddl:
    """Sandwiches for children at tables, some of whom need pure ones."""
    rng = np.random.default_rng(seed)
    allergic = rng.permutation(children)[: round(0.4 * children)]
    sandwiches = round(1.3 * children)
    start = [f"unmade s{i}" for i in range(sandwiches)]
    start += [f"tray-at t{i} kitchen" for i in range(trays)]
    for i in range(children):
        start += [f"bread-left b{i}", f"filling-left f{i}", f"sits c{i} x{rng.integers(tables)}"]
        start.append(f"{'allergic' if i in allergic else 'eats-all'} c{i}")
    for kind, name in (("bread", "b"), ("filling", "f")):
        pure = rng.permutation(children)[: len(allergic)]
        start += [f"pure-{kind} {name}{i}" for i in sorted(pure.tolist())]
    counts = {"child": ("c", children), "bread": ("b", children), "filling": ("f", children)}
    counts |= {"tray": ("t", trays), "sandwich": ("s", sandwiches), "table": ("x", tables)}
    goal = [f"fed c{i}" for i in range(children)]
    return SNACKS, problem("snacks", objects(counts), start, goal)


def orders(seed: int, num_orders: int, products: int, density: float) -> Pddl:
    """Orders of several products, each made once while all its orders stand open, on few stacks; a
    schema for each product and for each order."""
    rng = np.random.default_rng(seed)
    wanted = rng.random((num_orders, products)) < density
    wanted[np.arange(num_orders), rng.integers(0, products, num_orders)] = True
    wanted[rng.integers(0, num_orders, products), np.arange(products)] = True
    makes = "".join(
        f" (:action make-g{p} :parameters () :precondition (and (unmade g{p})"
        f" {' '.join(f'(open o{o})' for o in np.flatnonzero(wanted[:, p]))})"
        f" :effect (and (made g{p}) (not (unmade g{p}))))\n"
        for p in range(products)
    )
    sends = "".join(
        f" (:action send-o{o} :parameters (?n ?m - count) :precondition (and (open o{o})"
        f" {' '.join(f'(made g{p})' for p in np.flatnonzero(wanted[o]))} (stacks ?n) (after ?n ?m))"
        f" :effect (and (sent o{o}) (stacks ?m) (not (open o{o})) (not (stacks ?n))))\n"
        for o in range(num_orders)
    )
    constants = objects({"order": ("o", num_orders), "product": ("g", products)})
    domain = (
        "(define (domain orders) (:requirements :strips :typing) (:types order product count)\n"
        f" (:constants {constants})\n"
        " (:predicates (waiting ?o - order) (open ?o - order) (sent ?o - order)"
        " (made ?g - product) (unmade ?g - product) (stacks ?n - count) (after ?n ?m - count))\n"
        " (:action begin :parameters (?o - order ?n ?m - count)"
        " :precondition (and (waiting ?o) (stacks ?m) (after ?n ?m))"
        " :effect (and (open ?o) (stacks ?n) (not (waiting ?o)) (not (stacks ?m))))\n"
        " (:action more-room :parameters (?n ?m - count) :precondition (and (stacks ?n)"
        f" (after ?n ?m)) :effect (and (stacks ?m) (not (stacks ?n))))\n{makes}{sends})"
    )
    start = ["stacks n0", *(f"after n{i} n{i + 1}" for i in range(num_orders))]
    start += [f"waiting o{o}" for o in range(num_orders)]
    start += [f"unmade g{p}" for p in range(products)]
    goal = [f"sent o{o}" for o in range(num_orders)]
    return domain, problem("orders", objects({"count": ("n", num_orders + 1)}), start, goal)


def bar(seed: int, juices: int, cocktails: int, spare: int) -> Pddl:
    """Cocktails of two juices, shaken and served in glasses of their own, by two hands."""
    rng = np.random.default_rng(seed)
    glasses = cocktails + spare
    start = ["on-bar s0", "blank s0", "clean s0", "fill-at s0 l0", "empty-fill s0 l0"]
    start += ["more l0 l1", "more l1 l2", "idle left", "idle right"]
    for glass in range(glasses):
        start += [f"on-bar g{glass}", f"clean g{glass}", f"blank g{glass}"]
    start += [f"gives d{i} j{i}" for i in range(juices)]
    goal = []
    for cocktail in range(cocktails):
        one, other = rng.choice(juices, 2, replace=False)
        start += [f"first-part c{cocktail} j{one}", f"second-part c{cocktail} j{other}"]
        goal.append(f"has g{cocktail} c{rng.integers(cocktails)}")
    goal += [f"has g{cocktails + i} j{rng.integers(juices)}" for i in range(max(0, spare - 1))]
    counts = {"juice": ("j", juices), "cocktail": ("c", cocktails), "tap": ("d", juices)}
    counts |= {"glass": ("g", glasses), "shaker": ("s", 1), "fill": ("l", 3)}
    return BAR, problem("bar", f"left right - hand {objects(counts)}", start, goal)


def workshop_tasks() -> Iterator[tuple[str, Pddl]]:
    """Yields the series, (name, (domain, problem)) each, every one from small to large."""
    for i, (children, trays, tables) in enumerate(
        ((3, 1, 2), (4, 2, 3), (6, 2, 3), (8, 2, 3), (10, 3, 3), (12, 3, 3), (15, 3, 3), (18, 4, 4))
    ):
        yield f"childsnack-{i + 1}", snacks(i, children, trays, tables)
    for i, (num_orders, products, density) in enumerate(
        ((4, 4, 0.3), (8, 8, 0.3), (12, 12, 0.2), (20, 20, 0.15), (30, 30, 0.1), (50, 50, 0.06))
    ):
        yield f"openstacks-{i + 1}", orders(i, num_orders, products, density)
    for i, (juices, cocktails, spare) in enumerate(
        ((2, 1, 1), (3, 2, 1), (3, 3, 1), (3, 4, 1), (3, 6, 1), (4, 8, 1), (4, 10, 2), (5, 12, 2))
    ):
        yield f"barman-{i + 1}", bar(i, juices, cocktails, spare)
