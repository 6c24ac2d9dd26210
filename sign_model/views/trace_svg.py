"""The iterations of MAP as a small animation: an SVG file that moves by itself in a browser."""

from sign_model.views import svg
from sign_model.views.trace import Iteration, Trace

_WIDTH, _ROW, _MOST_ROWS = 760, 18, 14


def animate_trace(trace: Trace, *, seconds: float = 2.0) -> str:
    """Returns the text of an SVG file that shows one iteration after the other, again and again:
    the situation, the candidates with their ratings, and the plan as it grows backwards.

    Args:
      trace: of a task that has a plan.
      seconds: for each iteration.

    Raises:
      ValueError: the trace has no plan, or `seconds` is not above 0.

    Examples:
      >>> import sign_model
      >>> domain = '''(define (domain door)
      ...   (:predicates (closed) (open) (through))
      ...   (:action push :precondition (closed) :effect (and (open) (not (closed))))
      ...   (:action walk :precondition (open) :effect (through)))'''
      >>> problem = "(define (problem out) (:domain door) (:init (closed)) (:goal (through)))"
      >>> trace = sign_model.trace(sign_model.load(domain, problem))
      >>> sign_model.animate_trace(trace).count("<animate ")  # frames
      3
    """
    if trace.plan is None:
        raise ValueError("there is no plan to show: give the trace of a task that MAP solved")
    if not seconds > 0:
        raise ValueError(f"an iteration must be shown for more than 0 s, got {seconds}")
    count = len(trace.iterations)
    frames = [_frame(number, trace) for number in range(count)]
    frames.append(_last(trace))
    tallest = 90 + _ROW * (_MOST_ROWS + 2)
    parts = []
    for number, frame in enumerate(frames):
        parts.append(f'<g visibility="{"visible" if number == 0 else "hidden"}">')
        parts += frame
        parts.append(_turn(number, len(frames), seconds))
        parts.append("</g>")
    return svg.picture(_WIDTH, tallest, "MAP's iterations", parts)


def _turn(number: int, count: int, seconds: float) -> str:
    """Returns the animation by which one of the frames is visible in its turn alone."""
    begin, end = number / count, (number + 1) / count
    values = ["hidden", "visible", "hidden"] if number else ["visible", "hidden"]
    times = [0.0, begin, end] if number else [0.0, end]
    if number == count - 1:
        values, times = values[:2], times[:2]
    return (
        f'<animate attributeName="visibility" values="{";".join(values)}"'
        f' keyTimes="{";".join(f"{time:.5f}" for time in times)}" calcMode="discrete"'
        f' dur="{seconds * count:g}s" repeatCount="indefinite"/>'
    )


def _frame(number: int, trace: Trace) -> list[str]:
    one, count = trace.iterations[number], len(trace.iterations)
    parts = [svg.text(16, 28, f"Iteration {number + 1} of {count}", size=16)]
    parts += _column(16, "situation", one.situation, set(one.situation) - set(one.before))
    parts += _candidates(270, one)
    parts += _plan(560, trace, number)
    return parts


def _last(trace: Trace) -> list[str]:
    count = len(trace.iterations)
    situation = trace.iterations[-1].before if count else ()
    parts = [svg.text(16, 28, "The situation is included in the start", size=16)]
    parts += _column(16, "situation", situation, set())
    parts += _column(270, "start", trace.start, set())
    parts += _plan(560, trace, count)
    return parts


def _column(x: float, title: str, lines: tuple[str, ...], marked: set[str]) -> list[str]:
    """Returns a list under a title; what is marked, which the action brings about, stands out."""
    parts = [svg.text(x, 60, title, colour=svg.PALE)]
    for row, line in enumerate(lines[:_MOST_ROWS]):
        colour = svg.ACCENT if line in marked else svg.INK
        parts.append(svg.text(x, 82 + row * _ROW, line, colour=colour))
    if len(lines) > _MOST_ROWS:
        more = f"and {len(lines) - _MOST_ROWS} more"
        parts.append(svg.text(x, 82 + _MOST_ROWS * _ROW, more, colour=svg.PALE))
    return parts


def _candidates(x: float, one: Iteration) -> list[str]:
    """Returns the candidates with a bar for each rating."""
    parts = [svg.text(x, 60, "M: what fits, A: its rating", colour=svg.PALE)]
    shown = list(enumerate(one.candidates))[:_MOST_ROWS]
    if one.taken >= _MOST_ROWS:
        shown[-1] = (one.taken, one.candidates[one.taken])
    worst = max(1, *(candidate.rating for _, candidate in shown))
    for row, (number, candidate) in enumerate(shown):
        y, is_taken = 82 + row * _ROW, number == one.taken
        length = 90 * candidate.rating / worst
        fill = svg.ACCENT if is_taken else "#d1d5db"
        parts.append(svg.text(x, y, candidate.action, colour=svg.ACCENT if is_taken else svg.INK))
        parts.append(svg.box(x + 160, y - 10, max(1.0, length), 11, fill=fill))
        parts.append(svg.text(x + 164 + length, y, str(candidate.rating), size=10))
    return parts


def _plan(x: float, trace: Trace, number: int) -> list[str]:
    """Returns the end of the plan that `number` iterations and the present one have found."""
    plan = trace.plan or ()
    begin = max(0, len(plan) - number - 1)
    known = plan[begin:]
    marked = {known[0]} if number < len(plan) and known else set()
    return _column(x, "P: the plan, from its end", known, marked)
