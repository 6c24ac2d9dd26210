"""Precedents: for the same task, under other names, for other tasks; and the file they are saved
in.
"""

import dataclasses
import itertools
import json

import numpy as np
import pytest

from sign_model.experience.memory import Memory, load_memory, save_memory
from sign_model.experience.precedent import precedent_sign, with_precedent
from sign_model.experience.renaming import colours, find_renaming
from sign_model.pddl.grounding import load
from sign_model.pddl.planning_task import task_from_arrays
from sign_model.pddl.validate import validate
from sign_model.plan_task import plan
from sign_model.signs.from_tasks import world_model_of
from sign_model.signs.recognition import expectation, recognise
from sign_model.signs.sign import causal, sequence

BLOCKS = """(define (domain blocks) (:predicates (on ?x ?y) (ontable ?x) (clear ?x) (handempty)
  (holding ?x))
 (:action pick-up :parameters (?x) :precondition (and (clear ?x) (ontable ?x) (handempty))
  :effect (and (not (ontable ?x)) (not (clear ?x)) (not (handempty)) (holding ?x)))
 (:action put-down :parameters (?x) :precondition (holding ?x)
  :effect (and (not (holding ?x)) (clear ?x) (handempty) (ontable ?x)))
 (:action stack :parameters (?x ?y) :precondition (and (holding ?x) (clear ?y))
  :effect (and (not (holding ?x)) (not (clear ?y)) (clear ?x) (handempty) (on ?x ?y)))
 (:action unstack :parameters (?x ?y) :precondition (and (on ?x ?y) (clear ?x) (handempty))
  :effect (and (holding ?x) (clear ?y) (not (clear ?x)) (not (handempty)) (not (on ?x ?y)))))"""


def blocks(towers, goal):
    """Returns a blocks task: towers as words from the top down, the goal as pairs."""
    names = "".join(towers)
    facts = ["(handempty)"]
    for tower in towers:
        facts += [
            f"(clear {tower[0]})",
            f"(ontable {tower[-1]})",
            *(f"(on {x} {y})" for x, y in itertools.pairwise(tower)),
        ]
    wanted = " ".join(f"(on {x} {y})" for x, y in goal)
    return load(
        BLOCKS,
        f"(define (problem p) (:domain blocks) (:objects {' '.join(names)}) (:init"
        f" {' '.join(facts)}) (:goal (and {wanted})))",
    )


SWAP = blocks(["ab", "c"], ["ba", "cb"])
SWAP_PLAN = (
    "(unstack a b)",
    "(put-down a)",
    "(pick-up b)",
    "(stack b a)",
    "(pick-up c)",
    "(stack c b)",
)


def test_an_empty_memory_has_no_answer():
    assert Memory().recall(SWAP) is None and Memory().suggest(SWAP) is None


def test_a_goal_that_holds_at_the_start_needs_no_precedent():
    assert Memory().learned(SWAP, SWAP_PLAN).recall(blocks(["ab", "c"], ["ab"])) == ()


def test_the_same_task_is_recalled_with_its_plan():
    assert Memory().learned(SWAP, SWAP_PLAN).recall(SWAP) == SWAP_PLAN


def test_the_same_task_under_other_names_is_recalled_with_a_renamed_plan():
    other = blocks(["yx", "w"], ["xy", "wx"])
    recalled = Memory().learned(SWAP, SWAP_PLAN).recall(other)
    assert (
        recalled is not None and recalled[0] == "(unstack y x)" and validate(other, recalled) == []
    )


def test_a_larger_situation_that_includes_the_precedent_is_suggested_a_plan_but_not_recalled():
    larger, memory = blocks(["zq", "dc", "v"], ["cd"]), Memory().learned(SWAP, SWAP_PLAN)
    suggested = memory.suggest(larger)
    assert (
        memory.recall(larger) is None
        and suggested is not None
        and validate(larger, suggested) == []
    )


def test_a_precedent_that_does_not_fit_is_not_used():
    memory = Memory().learned(SWAP, SWAP_PLAN)
    for task in (blocks(["ab", "c"], ["ac"]), blocks(["abc"], ["ba", "cb"])):
        assert memory.recall(task) is None and memory.suggest(task) is None


def test_of_two_precedents_the_shorter_plan_is_recalled():
    detour = ("(pick-up c)", "(put-down c)", *SWAP_PLAN)
    memory = Memory().learned(SWAP, detour).learned(SWAP, SWAP_PLAN)
    assert len(memory.precedents) == 2 and memory.recall(SWAP) == memory.suggest(SWAP) == SWAP_PLAN
    assert memory.learned(SWAP, detour) is memory


def test_a_plan_that_does_not_solve_its_task_is_refused():
    with pytest.raises(ValueError, match="only a plan that solves its task can be learned from"):
        Memory().learned(SWAP, SWAP_PLAN[:-1])


def test_constants_play_only_themselves():
    domain = """(define (domain d) (:constants home away) (:predicates (at ?p))
      (:action go-home :parameters (?p) :precondition (at ?p) :effect (and (not (at ?p)) (at home)))
      (:action leave :parameters () :precondition (at home)
        :effect (and (not (at home)) (at away))))"""

    def task(start, goal):
        return load(
            domain,
            f"(define (problem p) (:domain d) (:objects x y) (:init (at {start})) (:goal (at"
            f" {goal})))",
        )

    memory = Memory().learned(task("x", "home"), ["(go-home x)"])
    assert memory.recall(task("y", "home")) == ("(go-home y)",)
    assert memory.recall(task("home", "away")) is memory.suggest(task("home", "away")) is None


def test_suggestions_for_random_tasks_are_valid_and_other_domains_get_none():
    rng = np.random.default_rng(0)
    memory = Memory().learned(SWAP, SWAP_PLAN).learned(blocks(["ab"], ["ba"]), SWAP_PLAN[:4])
    num_suggested = 0
    for _ in range(60):
        names = "".join(rng.permutation(list("abcd")))
        cut = int(rng.integers(1, 4))
        x, y = rng.choice(list("abcd"), 2, replace=False)
        task = blocks([names[:cut], names[cut:]], [x + y])
        suggested = memory.suggest(task)
        if suggested is not None:
            num_suggested += 1
            assert validate(task, suggested) == []
    assert num_suggested >= 2
    other = load(
        BLOCKS.replace("domain blocks", "domain bricks"),
        "(define (problem p) (:domain bricks) (:objects a) (:init) (:goal (clear a)))",
    )
    assert memory.suggest(other) is None


def random_task(rng, num_blocks):
    def towers():
        order = rng.permutation(list("abcdef")[:num_blocks]).tolist()
        cuts = [0, *(i for i in range(1, num_blocks) if rng.random() < 0.4), num_blocks]
        return ["".join(order[i:j]) for i, j in itertools.pairwise(cuts)]

    goal = [x + y for tower in towers() for x, y in itertools.pairwise(tower)]
    return blocks(towers(), goal or ["ab"])


def test_experience_solves_repeated_tasks_at_once_and_lengthens_no_other_plan():
    rng, memory = np.random.default_rng(2), Memory()
    known = [random_task(rng, 4) for _ in range(25)]
    for task in known:
        memory = memory.learned(task, plan(task).actions)
    assert {plan(task, memory=memory).expansions for task in known} == {1}
    for task in [random_task(rng, int(rng.integers(3, 6))) for _ in range(40)]:
        without, with_memory = plan(task), plan(task, memory=memory)
        assert with_memory.is_solved and len(with_memory.actions) <= len(without.actions)


def test_a_task_from_arrays_is_recalled_only_for_an_equal_task():
    rule = np.eye(2, dtype=bool)
    start, goal = np.array([True, False]), np.array([False, True])
    task = task_from_arrays(rule[:1], rule[1:], rule[:1], start, goal)
    memory = Memory().learned(task, ["(a0)"])
    assert memory.recall(task) == memory.suggest(task) == ("(a0)",)
    other = dataclasses.replace(task, conditions=rule[1:])
    assert memory.recall(other) is memory.suggest(other) is None


def test_tasks_that_differ_in_their_costs_are_not_the_same():
    domain = """(define (domain d) (:requirements :action-costs) (:predicates (at ?p))
      (:functions (total-cost) (toll ?p))
      (:action go :parameters (?p ?q) :precondition (at ?p)
        :effect (and (not (at ?p)) (at ?q) (increase (total-cost) (toll ?q)))))"""

    def task(toll):
        return load(
            domain,
            f"""(define (problem p) (:domain d) (:objects x y)
              (:init (at x) (= (toll x) 1) (= (toll y) {toll}))
              (:goal (at y)) (:metric minimize (total-cost)))""",
        )

    memory = Memory().learned(task(3), ["(go x y)"])
    assert (
        memory.recall(task(3)) == memory.suggest(task(4)) == ("(go x y)",)
        and memory.recall(task(4)) is None
    )


def test_a_match_gives_up_after_max_nodes():
    atoms = {("on", a, b) for a in "abcdef" for b in "abcdef" if a != b}
    assert (
        find_renaming(atoms, atoms, (), (), may_play=lambda role, name: True, max_nodes=3) is None
    )
    assert (
        find_renaming(atoms, atoms, (), (), may_play=lambda role, name: True, max_nodes=100)
        is not None
    )


def test_a_match_backtracks_from_a_choice_that_fails():
    def match(*needs):
        start = [("on", "a", "b"), ("on", "c", "d"), ("on", "d", "e")]
        return find_renaming(needs, start, (), (), may_play=lambda role, name: True, max_nodes=50)

    assert match(("on", "x", "y"), ("on", "y", "z")) == {"x": "c", "y": "d", "z": "e"}
    assert (
        match(("on", "x", "x")) is None
        and match(("on", "x", "y"), ("on", "y", "z"), ("on", "z", "x")) is None
    )


def test_a_role_is_played_by_an_object_of_its_type():
    domain = """(define (domain d) (:types big small) (:predicates (parked ?v) (done))
      (:action drive :parameters (?v - small) :precondition (parked ?v) :effect (done)))"""

    def task(objects, parked):
        return load(
            domain,
            f"(define (problem p) (:domain d) (:objects {objects}) (:init {parked}) (:goal"
            " (done)))",
        )

    memory = Memory().learned(task("s - small", "(parked s)"), ["(drive s)"])
    assert memory.suggest(task("a - big b - small", "(parked a) (parked b)")) == ("(drive b)",)


def test_a_task_with_one_more_object_is_not_the_same():
    memory = Memory().learned(blocks(["ab"], ["ba"]), SWAP_PLAN[:4])
    assert memory.recall(blocks(["ab", "c"], ["ba"])) is None
    assert memory.suggest(blocks(["ab", "c"], ["ba"])) == SWAP_PLAN[:4]


def test_colours_distinguish_objects_by_their_neighbours():
    distinct = colours(
        dict.fromkeys("abcd", ("block",)), {"start": [("on", "a", "b"), ("on", "b", "c")]}
    )
    assert len(set(distinct.values())) == 4
    alike = colours({"a": (), "b": ()}, {"start": [("clear", "a"), ("clear", "b")]})
    assert alike["a"] == alike["b"] and colours({}, {}) == {}


def test_the_image_of_a_precedent_is_the_sequence_of_its_acts():
    (precedent,) = Memory().learned(blocks(["ab"], ["ba"]), SWAP_PLAN[:4]).precedents
    sign = precedent_sign(precedent, "precedent 1")
    assert sign.image == (
        sequence("act (unstack a b)", "act (put-down a)", "act (pick-up b)", "act (stack b a)"),
    )
    assert sign.meaning == (
        causal(
            {"(on a b)", "(clear a)", "(handempty)", "(ontable b)"},
            {"(on b a)", "(clear b)", "(handempty)", "(ontable a)"},
        ),
    )


def test_a_model_with_a_precedent_recognises_its_plan_and_expects_the_next_act():
    task = blocks(["ab"], ["ba"])
    (precedent,) = Memory().learned(task, SWAP_PLAN[:4]).precedents
    model = with_precedent(world_model_of(task), precedent, "precedent 1")
    acts = [f"act {action}" for action in SWAP_PLAN[:4]]
    flow = np.stack([model.features([act]) for act in acts])
    number = model.index("precedent 1")
    found = recognise(model.matrices, flow[:3])
    expected = np.asarray(expectation(model.matrices, found))[number]
    assert not found.recognised[number] and model.named(expected > 0) == (acts[3],)
    assert int(recognise(model.matrices, flow).step[number]) == 3


def test_a_precedent_may_need_static_facts_that_have_no_sign_yet():
    domain = """(define (domain d) (:predicates (at ?p) (road ?p ?q))
      (:action go :parameters (?p ?q) :precondition (and (at ?p) (road ?p ?q))
        :effect (and (not (at ?p)) (at ?q))))"""
    task = load(
        domain,
        "(define (problem p) (:domain d) (:objects x y) (:init (at x) (road x y)) (:goal (at y)))",
    )
    (precedent,) = Memory().learned(task, ["(go x y)"]).precedents
    model = with_precedent(world_model_of(task), precedent, "precedent 1")
    assert model.sign("precedent 1").meaning == (causal({"(at x)", "(road x y)"}, "(at y)"),)


def test_a_memory_is_saved_and_loaded_without_loss(tmp_path):
    memory = Memory().learned(SWAP, SWAP_PLAN).learned(blocks(["ab"], ["ba"]), SWAP_PLAN[:4])
    save_memory(memory, tmp_path / "memory.json")
    assert load_memory(tmp_path / "memory.json") == memory
    assert [path.name for path in tmp_path.iterdir()] == ["memory.json"]


@pytest.mark.parametrize(
    "change, message",
    [
        (lambda entry: entry.pop("needs"), "precedent 1: must have exactly the parts"),
        (lambda entry: entry.update(domain=3), "precedent 1: domain must be text"),
        (lambda entry: entry.update(objects=[["a"]]), "precedent 1: objects must be pairs"),
        (
            lambda entry: entry.update(plan=[["stack", 1]]),
            "precedent 1: plan must be a list of lists of names",
        ),
        (
            lambda entry: entry.update(goal=[[]]),
            "precedent 1: goal must be a list of lists of names",
        ),
    ],
)
def test_an_error_in_a_memory_file_names_the_file_and_the_precedent(tmp_path, change, message):
    path = tmp_path / "memory.json"
    save_memory(Memory().learned(SWAP, SWAP_PLAN), path)
    plain = json.loads(path.read_text())
    change(plain["precedents"][0])
    path.write_text(json.dumps(plain))
    with pytest.raises(ValueError, match=message):
        load_memory(path)


@pytest.mark.parametrize(
    "text, message",
    [("{", "not JSON"), ("[]", "its format must be"), ('{"format": "x"}', "its format must be")],
)
def test_a_file_that_is_not_a_memory_is_refused(tmp_path, text, message):
    path = tmp_path / "memory.json"
    path.write_text(text)
    with pytest.raises(ValueError, match=message):
        load_memory(path)
