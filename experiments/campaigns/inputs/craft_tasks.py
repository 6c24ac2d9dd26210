"""Random planning tasks of crafts, (domain, problem), from small ones up: probes that send what
they found from where the base is seen, wagons shunted from one siding to another, tools that are
sharpened and carried to jobs, boards that go from machine to machine. Written as a third hold-out
for what was chosen on other series.
"""

import itertools

import numpy as np

from experiments.campaigns.inputs.vehicle_tasks import (
    Pddl,
    both_ways,
    network,
    objects,
    problem,
)

PROBES = """(define (domain probes) (:requirements :strips :typing) (:types site probe find)
 (:predicates (path ?x ?y - site) (stands ?p - probe ?x - site) (lies ?f - find ?x - site)
   (bare ?p - probe) (bears ?p - probe ?f - find) (known ?p - probe ?f - find)
   (in-sight ?x - site) (sent ?f - find) (hard ?f - find) (soft ?f - find) (drills ?p - probe))
 (:action crawl :parameters (?p - probe ?x ?y - site)
  :precondition (and (stands ?p ?x) (path ?x ?y)) :effect (and (stands ?p ?y) (not (stands ?p ?x))))
 (:action scoop :parameters (?p - probe ?f - find ?x - site)
  :precondition (and (stands ?p ?x) (lies ?f ?x) (soft ?f) (bare ?p))
  :effect (and (bears ?p ?f) (not (bare ?p)) (not (lies ?f ?x))))
 (:action drill :parameters (?p - probe ?f - find ?x - site)
  :precondition (and (stands ?p ?x) (lies ?f ?x) (hard ?f) (drills ?p) (bare ?p))
  :effect (and (bears ?p ?f) (not (bare ?p)) (not (lies ?f ?x))))
 (:action study :parameters (?p - probe ?f - find)
  :precondition (bears ?p ?f)
  :effect (and (known ?p ?f) (bare ?p) (not (bears ?p ?f))))
 (:action send :parameters (?p - probe ?f - find ?x - site)
  :precondition (and (known ?p ?f) (stands ?p ?x) (in-sight ?x)) :effect (sent ?f)))"""

SHUNTING = """(define (domain shunting) (:requirements :strips :typing)
 (:types wagon siding room)
 (:predicates (front ?w - wagon ?s - siding) (behind ?w ?v - wagon) (last ?w - wagon)
   (bare ?s - siding) (hooked ?w - wagon) (idle) (left ?s - siding ?n - room)
   (less ?m ?n - room) (stands ?w - wagon ?s - siding))
 (:action pull-last :parameters (?w - wagon ?s - siding ?m ?n - room)
  :precondition (and (idle) (front ?w ?s) (last ?w) (left ?s ?m) (less ?m ?n))
  :effect (and (hooked ?w) (bare ?s) (left ?s ?n) (not (idle)) (not (front ?w ?s)) (not (last ?w))
   (not (left ?s ?m)) (not (stands ?w ?s))))
 (:action pull :parameters (?w ?v - wagon ?s - siding ?m ?n - room)
  :precondition (and (idle) (front ?w ?s) (behind ?v ?w) (left ?s ?m) (less ?m ?n))
  :effect (and (hooked ?w) (front ?v ?s) (left ?s ?n) (not (idle)) (not (front ?w ?s))
   (not (behind ?v ?w)) (not (left ?s ?m)) (not (stands ?w ?s))))
 (:action push-first :parameters (?w - wagon ?s - siding ?m ?n - room)
  :precondition (and (hooked ?w) (bare ?s) (left ?s ?n) (less ?m ?n))
  :effect (and (front ?w ?s) (last ?w) (left ?s ?m) (idle) (stands ?w ?s) (not (hooked ?w))
   (not (bare ?s)) (not (left ?s ?n))))
 (:action push :parameters (?w ?v - wagon ?s - siding ?m ?n - room)
  :precondition (and (hooked ?w) (front ?v ?s) (left ?s ?n) (less ?m ?n))
  :effect (and (front ?w ?s) (behind ?v ?w) (left ?s ?m) (idle) (stands ?w ?s) (not (hooked ?w))
   (not (front ?v ?s)) (not (left ?s ?n)))))"""

TOOLS = """(define (domain tools) (:requirements :strips :typing) (:types spot tool kind job hand)
 (:predicates (way ?x ?y - spot) (stands ?x - spot) (lies ?t - tool ?x - spot) (free ?h - hand)
   (holds ?h - hand ?t - tool) (of ?t - tool ?k - kind) (sharp ?t - tool) (grindstone ?x - spot)
   (wants ?j - job ?k - kind) (at-job ?j - job ?x - spot) (done ?j - job) (open ?j - job))
 (:action walk :parameters (?x ?y - spot) :precondition (and (stands ?x) (way ?x ?y))
  :effect (and (stands ?y) (not (stands ?x))))
 (:action take :parameters (?t - tool ?x - spot ?h - hand)
  :precondition (and (stands ?x) (lies ?t ?x) (free ?h))
  :effect (and (holds ?h ?t) (not (lies ?t ?x)) (not (free ?h))))
 (:action lay :parameters (?t - tool ?x - spot ?h - hand)
  :precondition (and (stands ?x) (holds ?h ?t))
  :effect (and (lies ?t ?x) (free ?h) (not (holds ?h ?t))))
 (:action grind :parameters (?t - tool ?x - spot ?h - hand)
  :precondition (and (stands ?x) (grindstone ?x) (holds ?h ?t)) :effect (sharp ?t))
 (:action work :parameters (?j - job ?t - tool ?k - kind ?x - spot ?h - hand)
  :precondition (and (stands ?x) (at-job ?j ?x) (wants ?j ?k) (holds ?h ?t) (of ?t ?k) (sharp ?t)
   (open ?j))
  :effect (and (done ?j) (not (open ?j)) (not (sharp ?t)))))"""

BOARDS = """(define (domain boards) (:requirements :strips :typing) (:types board machine tint)
 (:predicates (rough ?b - board) (sawn ?b - board) (smooth ?b - board)
   (coated ?b - board ?c - tint) (waits ?b - board) (inside ?b - board ?m - machine)
   (idle ?m - machine) (saw ?m - machine) (planer ?m - machine) (sprayer ?m - machine)
   (loaded ?m - machine ?c - tint) (glued ?a ?b - board) (mate ?a ?b - board))
 (:action feed :parameters (?b - board ?m - machine) :precondition (and (waits ?b) (idle ?m))
  :effect (and (inside ?b ?m) (not (waits ?b)) (not (idle ?m))))
 (:action eject :parameters (?b - board ?m - machine) :precondition (inside ?b ?m)
  :effect (and (waits ?b) (idle ?m) (not (inside ?b ?m))))
 (:action cut :parameters (?b - board ?m - machine)
  :precondition (and (inside ?b ?m) (saw ?m) (rough ?b))
  :effect (and (sawn ?b) (not (rough ?b))))
 (:action plane :parameters (?b - board ?m - machine)
  :precondition (and (inside ?b ?m) (planer ?m) (sawn ?b)) :effect (smooth ?b))
 (:action refill :parameters (?m - machine ?c ?d - tint)
  :precondition (and (sprayer ?m) (idle ?m) (loaded ?m ?c))
  :effect (and (loaded ?m ?d) (not (loaded ?m ?c))))
 (:action spray :parameters (?b - board ?m - machine ?c - tint)
  :precondition (and (inside ?b ?m) (sprayer ?m) (loaded ?m ?c) (smooth ?b))
  :effect (coated ?b ?c))
 (:action glue :parameters (?a ?b - board ?c - tint)
  :precondition (and (mate ?a ?b) (waits ?a) (waits ?b) (coated ?a ?c) (coated ?b ?c))
  :effect (glued ?a ?b)))"""


def probes(seed: int, sites: int, probes: int, finds: int) -> Pddl:
    """Probes that dig, study what they dug, and send it from where the base is in sight."""
    rng = np.random.default_rng(seed)
    start = both_ways("path x{} x{}", sorted(network(rng, list(range(sites)))))
    start += [f"in-sight x{i}" for i in range(0, sites, 4)]
    for i in range(probes):
        start += [f"stands p{i} x{rng.integers(sites)}", f"bare p{i}"]
        start += [f"drills p{i}"] if i % 2 == 0 else []
    for i in range(finds):
        start += [f"lies f{i} x{rng.integers(sites)}"]
        start += [f"{'hard' if rng.random() < 0.5 else 'soft'} f{i}"]
    counts = {"site": ("x", sites), "probe": ("p", probes), "find": ("f", finds)}
    goal = [f"sent f{i}" for i in range(finds)]
    return PROBES, problem("probes", objects(counts), start, goal)


def shunting(seed: int, wagons: int, sidings: int) -> Pddl:
    """Wagons on sidings of limited room that are to stand on other sidings."""
    rng = np.random.default_rng(seed)
    room = -(-wagons // sidings) + 2
    rows: list[list[int]] = [[] for _ in range(sidings)]
    for wagon in rng.permutation(wagons):
        open_ones = [row for row in rows if len(row) < room - 1]
        open_ones[rng.integers(len(open_ones))].append(int(wagon))
    start = ["idle", *(f"less n{i} n{i + 1}" for i in range(room))]
    for s, row in enumerate(rows):
        start += [f"left s{s} n{room - len(row)}"] + ([] if row else [f"bare s{s}"])
        start += [f"stands w{w} s{s}" for w in row]
        start += [f"behind w{b} w{a}" for a, b in itertools.pairwise(row)]
        start += [f"front w{row[0]} s{s}", f"last w{row[-1]}"] if row else []
    places = rng.permutation([s for s in range(sidings) for _ in range(room - 1)])[:wagons]
    goal = [f"stands w{w} s{s}" for w, s in enumerate(places)]
    counts = {"wagon": ("w", wagons), "siding": ("s", sidings), "room": ("n", room + 1)}
    return SHUNTING, problem("shunting", objects(counts), start, goal)


def tools(seed: int, spots: int, kinds: int, jobs: int) -> Pddl:
    """A worker with two hands; each job blunts its tool, which is sharpened where a stone is."""
    rng = np.random.default_rng(seed)
    start = both_ways("way x{} x{}", sorted(network(rng, list(range(spots)))))
    start += ["stands x0", "free h0", "free h1", f"grindstone x{rng.integers(spots)}"]
    for kind in range(kinds):
        start += [f"of t{kind} k{kind}", f"lies t{kind} x{rng.integers(spots)}"]
        start += [f"sharp t{kind}"] if rng.random() < 0.5 else []
    for job in range(jobs):
        start += [f"open j{job}", f"at-job j{job} x{rng.integers(spots)}"]
        start += [f"wants j{job} k{rng.integers(kinds)}"]
    counts = {"spot": ("x", spots), "tool": ("t", kinds), "kind": ("k", kinds)}
    counts |= {"job": ("j", jobs), "hand": ("h", 2)}
    return TOOLS, problem("tools", objects(counts), start, [f"done j{j}" for j in range(jobs)])


def boards(seed: int, boards: int, tints: int, sprayers: int) -> Pddl:
    """Boards that are sawn, planed and sprayed, some of them glued together."""
    rng = np.random.default_rng(seed)
    start = ["saw m0", "planer m1", "idle m0", "idle m1"]
    for i in range(sprayers):
        start += [f"sprayer m{2 + i}", f"idle m{2 + i}", f"loaded m{2 + i} c{rng.integers(tints)}"]
    goal, tint = [], rng.integers(tints, size=boards)
    for b in range(boards):
        start += [f"waits b{b}", f"sawn b{b}" if rng.random() < 0.3 else f"rough b{b}"]
        if b % 3 == 1:
            start.append(f"mate b{b - 1} b{b}")
            goal.append(f"glued b{b - 1} b{b}")
        else:
            goal.append(f"coated b{b} c{tint[b]}")
    counts = {"board": ("b", boards), "machine": ("m", 2 + sprayers), "tint": ("c", tints)}
    return BOARDS, problem("boards", objects(counts), start, goal)
