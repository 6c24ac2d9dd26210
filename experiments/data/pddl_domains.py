"""Small planning domains of our own, each with tasks: {name: (domain, problem)}, for
`experiments.campaigns.planning`.

They differ in what makes them hard: grids (gripper's rooms, sokoban, tiles, visiting), vehicles,
switches without any relation, negative conditions, constants, and tasks without a solution.
"""

GRIPPER = """(define (domain gripper) (:requirements :strips :typing) (:types room ball hand)
 (:predicates (robot-in ?r - room) (ball-in ?b - ball ?r - room) (empty ?h - hand)
   (carries ?h - hand ?b - ball))
 (:action go :parameters (?x ?y - room) :precondition (robot-in ?x) :effect (and (robot-in ?y) (not
   (robot-in ?x))))
 (:action grasp :parameters (?b - ball ?r - room ?h - hand) :precondition (and (ball-in ?b ?r)
   (robot-in ?r) (empty ?h))
  :effect (and (carries ?h ?b) (not (ball-in ?b ?r)) (not (empty ?h))))
 (:action release :parameters (?b - ball ?r - room ?h - hand) :precondition (and (carries ?h ?b)
   (robot-in ?r))
  :effect (and (ball-in ?b ?r) (empty ?h) (not (carries ?h ?b)))))"""

LOGISTICS = """(define (domain delivery) (:requirements :strips :typing)
 (:types place vehicle parcel - object airport - place truck plane - vehicle city)
 (:predicates (at ?x - object ?p - place) (inside ?x - parcel ?v - vehicle)
   (of ?p - place ?c - city))
 (:action load :parameters (?x - parcel ?v - vehicle ?p - place) :precondition (and (at ?x ?p)
   (at ?v ?p))
  :effect (and (inside ?x ?v) (not (at ?x ?p))))
 (:action unload :parameters (?x - parcel ?v - vehicle ?p - place) :precondition (and (inside ?x ?v)
   (at ?v ?p))
  :effect (and (at ?x ?p) (not (inside ?x ?v))))
 (:action drive :parameters (?t - truck ?p ?q - place ?c - city) :precondition (and (at ?t ?p)
   (of ?p ?c) (of ?q ?c))
  :effect (and (at ?t ?q) (not (at ?t ?p))))
 (:action fly :parameters (?f - plane ?p ?q - airport) :precondition (at ?f ?p) :effect (and
   (at ?f ?q) (not (at ?f ?p)))))"""

SOKOBAN = """(define (domain pushing) (:requirements :strips :typing) (:types cell box way)
 (:predicates (man ?c - cell) (box-at ?b - box ?c - cell) (clear ?c - cell)
   (next ?c ?d - cell ?w - way))
 (:action walk :parameters (?c ?d - cell ?w - way) :precondition (and (man ?c) (clear ?d)
   (next ?c ?d ?w))
  :effect (and (man ?d) (clear ?c) (not (man ?c)) (not (clear ?d))))
 (:action push :parameters (?b - box ?m ?c ?d - cell ?w - way)
  :precondition (and (man ?m) (box-at ?b ?c) (clear ?d) (next ?m ?c ?w) (next ?c ?d ?w))
  :effect (and (man ?c) (box-at ?b ?d) (clear ?m) (not (man ?m)) (not (box-at ?b ?c)) (not
   (clear ?d)))))"""

SWITCHES = """(define (domain switches) (:requirements :strips :negative-preconditions)
 (:predicates (on ?x) (ready ?x) (used ?x))
 (:action press :parameters (?x) :precondition (and (not (on ?x)) (ready ?x)) :effect (and (on ?x)
   (used ?x) (not (ready ?x))))
 (:action unpress :parameters (?x) :precondition (and (on ?x)) :effect (and (not (on ?x))))
 (:action charge :parameters (?x ?y) :precondition (and (on ?x) (not (on ?y))) :effect (and
   (ready ?y) (not (on ?x)))))"""

TILES = """(define (domain tiles) (:requirements :strips :typing) (:types tile place)
 (:predicates (lies ?t - tile ?p - place) (hole ?p - place) (beside ?p ?q - place))
 (:action slide :parameters (?t - tile ?p ?q - place) :precondition (and (lies ?t ?p) (hole ?q)
   (beside ?p ?q))
  :effect (and (lies ?t ?q) (hole ?p) (not (lies ?t ?p)) (not (hole ?q)))))"""

VISITING = """(define (domain visiting) (:requirements :strips) (:predicates (at ?c) (visited ?c)
   (beside ?c ?d))
 (:action move :parameters (?c ?d) :precondition (and (at ?c) (beside ?c ?d))
  :effect (and (at ?d) (visited ?d) (not (at ?c)))))"""

PAINTING = """(define (domain painting) (:requirements :strips :typing :equality
   :negative-preconditions) (:types colour wall)
 (:constants white - colour)
 (:predicates (holds ?c - colour) (painted ?w - wall ?c - colour) (primed ?w - wall) (clean))
 (:action dip :parameters (?c ?d - colour) :precondition (and (clean) (holds ?c) (not (= ?c ?d)))
  :effect (and (holds ?d) (not (holds ?c))))
 (:action wash :parameters () :precondition (not (clean)) :effect (clean))
 (:action prime :parameters (?w - wall) :precondition (and (holds white) (not (primed ?w)))
  :effect (and (primed ?w) (not (clean))))
 (:action paint :parameters (?w - wall ?c - colour) :precondition (and (holds ?c) (primed ?w) (not
   (= ?c white)))
  :effect (and (painted ?w ?c) (not (primed ?w)) (not (clean)))))"""


def _problem(domain: str, objects: str, start: list[str], goal: list[str]) -> str:
    def facts(atoms: list[str]) -> str:
        return " ".join(f"({atom})" for atom in atoms)

    return (
        f"(define (problem p) (:domain {domain}) (:objects {objects}) (:init {facts(start)}) (:goal"
        f" (and {facts(goal)})))"
    )


def gripper(num_balls: int) -> str:
    balls = [f"b{i}" for i in range(num_balls)]
    start = ["robot-in west", "empty left", "empty right", *(f"ball-in {b} west" for b in balls)]
    return _problem(
        "gripper",
        f"west east - room left right - hand {' '.join(balls)} - ball",
        start,
        [f"ball-in {b} east" for b in balls],
    )


def delivery(num_cities: int, num_parcels: int) -> str:
    cities = range(num_cities)
    objects = (
        f"{' '.join(f'c{i}' for i in cities)} - city {' '.join(f'air{i}' for i in cities)} -"
        " airport "
    )
    objects += (
        f"{' '.join(f'post{i}' for i in cities)} - place {' '.join(f't{i}' for i in cities)} -"
        " truck jet - plane "
    )
    objects += f"{' '.join(f'x{i}' for i in range(num_parcels))} - parcel"
    start = (
        ["at jet air0"]
        + [f"of {kind}{i} c{i}" for i in cities for kind in ("air", "post")]
        + [f"at t{i} post{i}" for i in cities]
    )
    start += [f"at x{i} post{i % num_cities}" for i in range(num_parcels)]
    return _problem(
        "delivery",
        objects,
        start,
        [f"at x{i} post{(i + 1) % num_cities}" for i in range(num_parcels)],
    )


def pushing(picture: str) -> str:
    """A sokoban from a picture: @ the man, $ a box, . a goal, * a box on a goal, # a wall."""
    rows = picture.split()
    cells = {
        (r, c): sign for r, row in enumerate(rows) for c, sign in enumerate(row) if sign != "#"
    }
    name = {cell: f"c{cell[0]}-{cell[1]}" for cell in cells}
    ways = {"up": (-1, 0), "down": (1, 0), "left": (0, -1), "right": (0, 1)}
    start = [
        f"next {name[r, c]} {name[r + dr, c + dc]} {way}"
        for r, c in cells
        for way, (dr, dc) in ways.items()
        if (r + dr, c + dc) in cells
    ]
    boxes = [cell for cell, sign in cells.items() if sign in "$*"]
    start += [f"box-at k{i} {name[cell]}" for i, cell in enumerate(boxes)]
    start += [
        ("man " if sign == "@" else "clear ") + name[cell]
        for cell, sign in cells.items()
        if sign not in "$*"
    ]
    goals = [cell for cell, sign in cells.items() if sign in ".*"]
    objects = (
        f"{' '.join(name.values())} - cell {' '.join(f'k{i}' for i in range(len(boxes)))} - box"
        f" {' '.join(ways)} - way"
    )
    return _problem(
        "pushing", objects, start, [f"box-at k{i} {name[cell]}" for i, cell in enumerate(goals)]
    )


def switches(count: int) -> str:
    names = [f"s{i}" for i in range(count)]
    return _problem("switches", " ".join(names), ["ready s0"], [f"used {name}" for name in names])


def tiles(rows: list[str]) -> str:
    """A sliding puzzle, 0 the hole; the goal is the reading order, the hole first."""
    height, width = len(rows), len(rows[0])
    places = {(r, c): f"p{r}{c}" for r in range(height) for c in range(width)}
    beside = [
        f"beside {p} {q}"
        for (r, c), p in places.items()
        for (i, j), q in places.items()
        if abs(r - i) + abs(c - j) == 1
    ]
    start = [
        f"hole {places[r, c]}" if rows[r][c] == "0" else f"lies t{rows[r][c]} {places[r, c]}"
        for r, c in places
    ]
    goal = [f"lies t{number} {p}" for number, p in enumerate(places.values()) if number]
    return _problem(
        "tiles",
        f"{' '.join(f't{i}' for i in range(1, height * width))} - tile {' '.join(places.values())}"
        " - place",
        beside + start,
        goal,
    )


def visiting(side: int) -> str:
    cells = {(r, c): f"c{r}{c}" for r in range(side) for c in range(side)}
    beside = [
        f"beside {p} {q}"
        for (r, c), p in cells.items()
        for (i, j), q in cells.items()
        if abs(r - i) + abs(c - j) == 1
    ]
    return _problem(
        "visiting",
        " ".join(cells.values()),
        [*beside, "at c00", "visited c00"],
        [f"visited {p}" for p in cells.values()],
    )


def painting(num_walls: int) -> str:
    walls = [f"w{i}" for i in range(num_walls)]
    goal = [f"painted {wall} {('red', 'blue')[i % 2]}" for i, wall in enumerate(walls)]
    return _problem(
        "painting", f"red blue - colour {' '.join(walls)} - wall", ["clean", "holds white"], goal
    )


OTHER_DOMAINS = {
    "gripper, 4 balls": (GRIPPER, gripper(4)),
    "gripper, 8 balls": (GRIPPER, gripper(8)),
    "delivery, 2 cities, 3 parcels": (LOGISTICS, delivery(2, 3)),
    "delivery, 4 cities, 6 parcels": (LOGISTICS, delivery(4, 6)),
    "sokoban, 1 box": (SOKOBAN, pushing("###### #@---# #-$--# #---.# ######")),
    "sokoban, 2 boxes": (SOKOBAN, pushing("####### #@----# #-$-$-# #----.# #----.# #######")),
    "sokoban, a box in the corner": (SOKOBAN, pushing("##### #$-@# #--.# #####")),
    "switches, 5": (SWITCHES, switches(5)),
    "tiles, 3 x 2": (TILES, tiles(["51", "40", "32"])),
    "tiles, 3 x 2, of the other parity": (TILES, tiles(["21", "34", "50"])),
    "tiles, 3 x 3": (TILES, tiles(["142", "358", "670"])),
    "visiting, 4 x 4": (VISITING, visiting(4)),
    "painting, 4 walls": (PAINTING, painting(4)),
}
