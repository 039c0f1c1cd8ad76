"""Small faults in Python sources, by way of the syntax tree."""

from __future__ import annotations

import ast
import copy
from collections.abc import Iterator

from tests.mutation.mutants import Mutant

COMPARED: dict[type[ast.cmpop], type[ast.cmpop]] = {
    ast.Lt: ast.LtE,
    ast.LtE: ast.Lt,
    ast.Gt: ast.GtE,
    ast.GtE: ast.Gt,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
    ast.Is: ast.IsNot,
    ast.IsNot: ast.Is,
    ast.In: ast.NotIn,
    ast.NotIn: ast.In,
}
COMBINED: dict[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.FloorDiv: ast.Mult,
    ast.Mod: ast.Mult,
    ast.Pow: ast.Mult,
    ast.BitAnd: ast.BitOr,
    ast.BitOr: ast.BitAnd,
}
SWAPPED = {
    **{"max": "min", "min": "max", "maximum": "minimum", "minimum": "maximum"},
    **{"ceil": "floor", "floor": "ceil", "any": "all", "all": "any", "median": "mean"},
    **{"mean": "median", "zeros": "ones", "ones": "zeros"},
}
"""Functions, by the last part of their names, and what each is replaced by."""

LEFT_OUT = {"max", "min", "maximum", "minimum", "abs", "sqrt", "ceil", "float_power"}
"""Functions that are also left out, so that their first argument alone remains."""


def python_mutants(source: str) -> Iterator[Mutant]:
    """Mutants of a Python source, in the order of its tree.

    Messages of errors, docstrings, f-strings, annotations, defaults and imports are left alone.
    """
    tree = ast.parse(source)
    for count, node in enumerate(_mutated_nodes(tree)):
        for choice in range(len(_changes(node))):
            changed = copy.deepcopy(tree)
            other = next(n for k, n in enumerate(_mutated_nodes(changed)) if k == count)
            before = ast.unparse(other)
            after = _apply(changed, other, choice)
            text = ast.unparse(ast.fix_missing_locations(changed)) + "\n"
            yield Mutant(_line(node), f"{before} -> {after}", text)


def _line(node: ast.AST) -> int:
    return getattr(node, "lineno", 0)


def _mutated_nodes(tree: ast.AST) -> Iterator[ast.expr]:
    """Expressions that can be mutated, always in the same order."""
    for name, value in ast.iter_fields(tree):
        if name in ("annotation", "returns", "decorator_list", "defaults", "kw_defaults"):
            continue
        for child in value if isinstance(value, list) else [value]:
            if isinstance(child, (ast.Raise, ast.JoinedStr, ast.Import, ast.ImportFrom)):
                continue
            if isinstance(child, ast.expr) and _changes(child):
                yield child
            if isinstance(child, ast.AST):
                yield from _mutated_nodes(child)


def _changes(node: ast.expr) -> list[ast.expr]:
    """What may stand in the place of an expression."""
    if isinstance(node, ast.Constant):
        return _other_constants(node)
    if isinstance(node, ast.Compare):
        return [
            ast.Compare(node.left, [*node.ops[:k], COMPARED[type(op)](), *node.ops[k + 1 :]],
                        node.comparators)
            for k, op in enumerate(node.ops)
        ]  # fmt: skip
    if isinstance(node, ast.BinOp) and type(node.op) in COMBINED:
        return [ast.BinOp(node.left, COMBINED[type(node.op)](), node.right)]
    if isinstance(node, ast.BoolOp):
        other = ast.Or() if isinstance(node.op, ast.And) else ast.And()
        return [ast.BoolOp(other, node.values), *node.values[:1]]
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, (ast.Not, ast.USub, ast.Invert)):
        return [node.operand]
    if isinstance(node, ast.IfExp):
        return [node.body, node.orelse]
    if isinstance(node, ast.Call):
        return _other_calls(node)
    return []


def _other_constants(node: ast.Constant) -> list[ast.expr]:
    if isinstance(node.value, bool):
        return [ast.Constant(not node.value)]
    if isinstance(node.value, int | float):
        return [ast.Constant(node.value + 1)]
    return []


def _other_calls(node: ast.Call) -> list[ast.expr]:
    place = node.func
    name = place.attr if isinstance(place, ast.Attribute) else getattr(place, "id", "")
    calls: list[ast.expr] = []
    if name in SWAPPED:
        func = copy.deepcopy(place)
        setattr(func, "attr" if isinstance(func, ast.Attribute) else "id", SWAPPED[name])
        calls.append(ast.Call(func, node.args, node.keywords))
    if name in LEFT_OUT and node.args and not isinstance(node.args[0], ast.GeneratorExp):
        calls += node.args if name in ("max", "min", "maximum", "minimum") else node.args[:1]
    return calls


def _apply(tree: ast.AST, node: ast.expr, choice: int) -> str:
    """Put a change in the place of a node of the tree; returns it as text."""
    other = _changes(node)[choice]
    for parent in ast.walk(tree):
        for name, value in ast.iter_fields(parent):
            if value is node:
                setattr(parent, name, other)
            elif isinstance(value, list) and any(item is node for item in value):
                setattr(parent, name, [other if item is node else item for item in value])
    return ast.unparse(other)
