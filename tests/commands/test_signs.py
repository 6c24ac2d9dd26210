"""`srt-jax signs`: a task's signs in words and pictures."""

import xml.etree.ElementTree as ElementTree

from srt_jax.cli import run

DOMAIN = """(define (domain door) (:predicates (closed) (open) (through))
 (:action push :precondition (closed) :effect (and (open) (not (closed))))
 (:action walk :precondition (open) :effect (through)))"""
PROBLEM = "(define (problem out) (:domain door) (:init (closed)) (:goal (through)))"


def called(tmp_path, *options):
    (tmp_path / "domain.pddl").write_text(DOMAIN)
    (tmp_path / "problem.pddl").write_text(PROBLEM)
    return run(["signs", str(tmp_path / "domain.pddl"), str(tmp_path / "problem.pddl"), *options])


def test_the_description_opens_with_what_matters(tmp_path, capsys):
    assert called(tmp_path) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[2:4] == ["At the start: (closed)", "Wanted: (through)"]
    assert lines.index("situation goal") < lines.index("action push") < lines.index("act (push)")


def test_one_sign_is_described_with_those_that_need_it(tmp_path, capsys):
    assert called(tmp_path, "--sign", "(open)") == 0
    text = capsys.readouterr().out
    assert "  needed in W_a by: act (push), act (walk)" in text and "\naction push\n" not in text
    assert called(tmp_path, "--sign", "nosuch") == 2
    assert "no sign is called 'nosuch'" in capsys.readouterr().err


def test_what_comes_to_mind_is_listed_nearest_first(tmp_path, capsys):
    assert called(tmp_path, "--recall", "situation goal") == 0
    assert capsys.readouterr().out.splitlines() == ["0.500 (through)", "0.250 predicate through"]


def test_iterations_and_pictures_are_written(tmp_path, capsys):
    networks, moving = tmp_path / "networks.svg", tmp_path / "map.svg"
    assert called(tmp_path, "--trace", "--svg", str(networks), "--animate", str(moving)) == 0
    assert "P: the situation before it: (open)" in capsys.readouterr().out
    for path in (networks, moving):
        assert ElementTree.parse(path).getroot().tag.endswith("svg")


def test_the_networks_are_written_for_graphviz(tmp_path, capsys):
    path = tmp_path / "networks.dot"
    assert called(tmp_path, "--dot", str(path)) == 0
    assert path.read_text().startswith("digraph") and not capsys.readouterr().out
