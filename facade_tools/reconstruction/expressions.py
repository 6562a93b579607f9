"""Expressions of shape grammars: arithmetic, comparisons, a few functions; nothing else."""

from __future__ import annotations

import ast
import math
import operator
from collections.abc import Callable, Mapping
from functools import lru_cache

import numpy as np

from ..errors import InvalidInput

Value = float | str | bool
Names = Mapping[str, Value]

LONGEST = 300  # characters
DEEPEST = 40

_ARITHMETIC: dict[type[ast.operator], Callable[[float, float], float]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul,
    ast.Div: operator.truediv, ast.Mod: operator.mod, ast.FloorDiv: operator.floordiv,
}  # fmt: skip
_COMPARISONS: dict[type[ast.cmpop], Callable[[Value, Value], bool]] = {
    ast.Lt: operator.lt, ast.LtE: operator.le, ast.Gt: operator.gt, ast.GtE: operator.ge,
    ast.Eq: operator.eq, ast.NotEq: operator.ne,
}  # fmt: skip
_FUNCTIONS: dict[str, Callable[..., float]] = {
    "min": min, "max": max, "abs": abs, "round": lambda x: float(math.floor(x + 0.5)),
    "floor": math.floor, "ceil": math.ceil, "sqrt": math.sqrt,
    "sin": lambda x: math.sin(math.radians(x)), "cos": lambda x: math.cos(math.radians(x)),
    "tan": lambda x: math.tan(math.radians(x)),
}  # fmt: skip
DRAWS = ("uniform", "normal", "choice")


def number(amount: object, names: Names, rng: np.random.Generator) -> float:
    """Return the finite number that an amount (a number or an expression) means.

    `uniform(a, b)`, `normal(mean, spread)` and `choice(a, b, ...)` draw. Raises InvalidInput.
    """
    if isinstance(amount, int | float) and not isinstance(amount, bool):
        return float(amount)
    value = evaluated(str(amount), names, rng)
    if isinstance(value, str) or not math.isfinite(value):
        raise InvalidInput(f"{amount!r} is {value!r}; expected a finite number")
    return float(value)


def holds(condition: str, names: Names, rng: np.random.Generator) -> bool:
    """Return whether a condition is true; an empty one is."""
    return not condition or bool(evaluated(condition, names, rng))


def evaluated(text: str, names: Names, rng: np.random.Generator) -> Value:
    """Return the value of an expression. Raises InvalidInput on what is none."""
    tree = parsed(text)
    try:
        return _value(tree, names, rng)
    except ZeroDivisionError:
        raise InvalidInput(f"{text!r} divides by zero") from None
    except (TypeError, ValueError, OverflowError) as error:
        raise InvalidInput(f"{text!r}: {error}") from None


@lru_cache(maxsize=4096)
def parsed(text: str) -> ast.expr:
    """Return the syntax tree of an expression of the language. Raises InvalidInput."""
    if len(text) > LONGEST:
        raise InvalidInput(f"an expression of more than {LONGEST} characters")
    try:
        tree = ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise InvalidInput(f"{text!r} is no expression") from None
    _check(tree, text, 0)
    return tree


def names_in(text: str) -> set[str]:
    """Return the names that an expression reads."""
    tree = parsed(text)
    called = {id(node.func) for node in ast.walk(tree) if isinstance(node, ast.Call)}
    found = (node for node in ast.walk(tree) if isinstance(node, ast.Name))
    return {node.id for node in found if id(node) not in called}


def _check(node: ast.expr, text: str, depth: int) -> None:
    known = True
    if isinstance(node, ast.Constant):
        known = isinstance(node.value, int | float | str) and not isinstance(node.value, bytes)
    elif isinstance(node, ast.BinOp):
        known = type(node.op) in _ARITHMETIC
    elif isinstance(node, ast.Compare):
        known = all(type(op) in _COMPARISONS for op in node.ops)
    elif isinstance(node, ast.Call):
        name = node.func.id if isinstance(node.func, ast.Name) else ""
        known = (name in _FUNCTIONS or name in DRAWS) and bool(node.args) and not node.keywords
    elif isinstance(node, ast.UnaryOp):
        known = isinstance(node.op, ast.USub | ast.UAdd | ast.Not)
    else:
        known = isinstance(node, ast.Name | ast.BoolOp | ast.IfExp)
    if not known or depth > DEEPEST:
        raise InvalidInput(f"{text!r} holds what is not allowed: {ast.unparse(node)[:60]!r}")
    for child in _operands(node):
        _check(child, text, depth + 1)


def _operands(node: ast.expr) -> list[ast.expr]:
    if isinstance(node, ast.Call):
        return node.args
    return [child for child in ast.iter_child_nodes(node) if isinstance(child, ast.expr)]


def _value(node: ast.expr, names: Names, rng: np.random.Generator) -> Value:
    if isinstance(node, ast.Constant):
        return node.value if isinstance(node.value, str) else float(node.value)  # type: ignore[arg-type]
    if isinstance(node, ast.Name):
        if node.id not in names:
            known = ", ".join(sorted(names))
            raise InvalidInput(f"{node.id!r} is no parameter; known here: {known}")
        return names[node.id]
    if isinstance(node, ast.BinOp):
        left, right = _value(node.left, names, rng), _value(node.right, names, rng)
        return _ARITHMETIC[type(node.op)](_plain(left), _plain(right))
    if isinstance(node, ast.Call):
        arguments = [_value(argument, names, rng) for argument in node.args]
        return _called(node.func.id, arguments, rng)  # type: ignore[attr-defined]
    return _logic(node, names, rng)


def _plain(value: Value) -> float:
    if isinstance(value, str):
        raise TypeError(f"{value!r} is no number")
    return float(value)


def _logic(node: ast.expr, names: Names, rng: np.random.Generator) -> Value:
    if isinstance(node, ast.UnaryOp):
        value = _value(node.operand, names, rng)
        if isinstance(node.op, ast.Not):
            return not value
        return -_plain(value) if isinstance(node.op, ast.USub) else _plain(value)
    if isinstance(node, ast.BoolOp):
        stop = isinstance(node.op, ast.Or)
        found = (bool(_value(value, names, rng)) == stop for value in node.values)
        return any(found) == stop
    if isinstance(node, ast.IfExp):
        chosen = node.body if _value(node.test, names, rng) else node.orelse
        return _value(chosen, names, rng)
    assert isinstance(node, ast.Compare)
    left = _value(node.left, names, rng)
    for op, part in zip(node.ops, node.comparators, strict=True):
        right = _value(part, names, rng)
        if not _COMPARISONS[type(op)](left, right):
            return False
        left = right
    return True


def _called(name: str, arguments: list[Value], rng: np.random.Generator) -> Value:
    if name == "choice":
        return arguments[int(rng.integers(len(arguments)))]
    numbers = [_plain(argument) for argument in arguments]
    if name == "uniform":
        low, high = numbers
        return low + (high - low) * float(rng.random())
    if name == "normal":
        mean, spread = numbers
        return mean + spread * float(rng.standard_normal())
    return float(_FUNCTIONS[name](*numbers))
