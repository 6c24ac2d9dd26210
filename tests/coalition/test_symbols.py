"""The symbolic level: the scene as STRIPS, MAP's plan, signs and messages."""

import pytest

import sign_model
from experiments.campaigns.coalitions import _fast_downward, _pyperplan
from sign_model.relocation.messages import THEY, I
from srt_jax import Status
from srt_jax.coalition import (
    coalition_lines,
    coalition_messages,
    coalition_texts,
    help_edges,
    planned_by_map,
    signs_of,
)


def of_several(solved):
    return [
        (task, answer)
        for task, answer in zip(*solved)
        if Status(int(answer.status)).is_solved and (task.goal >= 0).all(axis=1).any()
    ]


def test_the_plan_of_every_answer_is_valid_in_the_exported_domain(mixed, chain):
    for task, answer in of_several(mixed) + of_several(chain):
        problem = sign_model.load(*coalition_texts(task, answer))
        assert sign_model.validate(problem, coalition_lines(task, answer)) == []


def test_map_plans_the_steps_of_the_coalition(chain):
    task, answer = chain.tasks[0], chain.answers[0]
    plan = planned_by_map(task, answer)
    assert sign_model.validate(sign_model.load(*coalition_texts(task, answer)), plan) == []
    assert any(line.startswith("(tell agent-1 agent-0 obstacle-1") for line in plan)


def test_messages_tell_the_story_of_the_routes(mixed, chain):
    for task, answer in of_several(mixed) + of_several(chain):
        told = {m[1:] for m in coalition_messages(task, answer) if m.act == "tell"}
        assert told == set(help_edges(answer))


def test_abilities_are_the_meanings_of_i_and_they_and_messages_are_signs(chain):
    model = signs_of(chain.tasks[0], chain.answers[0], 0)

    def obstacles(name):
        features = frozenset().union(*(m.features for m in model.sign(name).meaning))
        return {feature for feature in features if feature.startswith("obstacle-")}

    assert obstacles(I) == {"obstacle-0"} and obstacles(THEY) == {"obstacle-1"}
    message = model.sign("message ask agent-0 agent-1 obstacle-1")
    assert [set(column.features) for column in message.image[0].columns] == [
        {"agent-0"},
        {"action ask"},
        {"agent-1"},
        {"obstacle-1"},
    ]


@pytest.mark.parametrize("plan", [_pyperplan, _fast_downward])
def test_other_planners_find_plans_of_the_exported_domain(chain, plan):
    texts = coalition_texts(chain.tasks[0], chain.answers[0])
    actions = plan(*texts)
    if actions is None:
        pytest.skip(f"{plan.__name__.strip('_')} is not installed (the extra bench brings it)")
    assert sign_model.validate(sign_model.load(*texts), actions) == []
