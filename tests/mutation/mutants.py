"""Small faults in a source text: an operator, comparison, number, index, sign or order of operands each.

Annotations, decorators, docstrings and what is raised stay: they hold no equation.
"""

import ast
import hashlib
from collections import Counter
from collections.abc import Iterator
from typing import NamedTuple

_OPERATORS: dict[type[ast.operator], type[ast.operator]] = {
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
# The bound itself, and the other side of it.
_COMPARISONS: dict[type[ast.cmpop], tuple[type[ast.cmpop], ...]] = {
    ast.Lt: (ast.LtE, ast.GtE),
    ast.LtE: (ast.Lt, ast.Gt),
    ast.Gt: (ast.GtE, ast.LtE),
    ast.GtE: (ast.Gt, ast.Lt),
    ast.Eq: (ast.NotEq,),
    ast.NotEq: (ast.Eq,),
    ast.Is: (ast.IsNot,),
    ast.IsNot: (ast.Is,),
    ast.In: (ast.NotIn,),
    ast.NotIn: (ast.In,),
}
_PAIRS = [("minimum", "maximum"), ("min", "max"), ("sin", "cos"), ("any", "all"), ("zeros", "ones")]
_FUNCTIONS = dict(_PAIRS) | {second: first for first, second in _PAIRS}
#: Products whose operands do not commute.
_ORDERED = {"cross", "outer"}


class Mutant(NamedTuple):
    """A source text with one fault."""

    key: str
    """Of the fault, whatever line it stands in."""
    line: int
    old: str
    new: str
    source: str
    """The whole text, with the fault."""


def mutants(source: str) -> list[Mutant]:
    """Every fault of a source text that is another program than the text, by line."""
    raw = source.encode()
    starts = [0]
    for line in raw.splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    made, times = [], Counter[str]()
    for place, fault in _faults(ast.parse(source)):
        # Such as x @ x with its operands in the other order.
        if ast.dump(place) == ast.dump(fault):
            continue
        if place.end_lineno is None or place.end_col_offset is None:
            raise ValueError(f"line {place.lineno}: got a node without an end, expected one of a parsed text")
        first = starts[place.lineno - 1] + place.col_offset
        last = starts[place.end_lineno - 1] + place.end_col_offset
        old, new = ast.unparse(place), ast.unparse(fault)
        # Parentheses, as the fault may bind less than what was there; a slice and a statement take none.
        written = f"({new})" if isinstance(fault, ast.expr) and not isinstance(fault, ast.Slice) else new
        changed = (raw[:first] + written.encode() + raw[last:]).decode()
        times[f"{old} {new}"] += 1
        key = hashlib.sha256(f"{old} {new} {times[f'{old} {new}']}".encode()).hexdigest()[:12]
        made.append(Mutant(key, place.lineno, old, new, changed))
    return sorted(made, key=lambda mutant: mutant.line)


def sample(population: list[Mutant], size: int) -> list[Mutant]:
    """Some of the mutants, by line: the same ones on every run, and a larger sample holds a smaller one."""
    chosen = {mutant.key for mutant in sorted(population)[:size]}
    return [mutant for mutant in population if mutant.key in chosen]


def _faults(tree: ast.AST, index: bool = False) -> Iterator[tuple[ast.expr | ast.stmt, ast.expr | ast.stmt]]:
    """Pairs of a node and what to put in its place; ``index`` says that numbers here are indices."""
    match tree:
        case ast.Raise() | ast.JoinedStr() | ast.Expr(value=ast.Constant()):
            return
        case ast.FunctionDef(args=args, body=body):
            children: list[ast.AST] = [*args.defaults, *(d for d in args.kw_defaults if d), *body]
        case ast.ClassDef(body=body):
            children = list(body)
        case ast.AnnAssign(value=value):
            children = [value] if value else []
        case _:
            children = list(ast.iter_child_nodes(tree))
    yield from _faults_here(tree, index)
    for child in children:
        below = isinstance(tree, ast.Subscript) and child is tree.slice
        yield from _faults(child, below or (index and isinstance(tree, ast.Slice | ast.Tuple)))


def _faults_here(node: ast.AST, index: bool) -> Iterator[tuple[ast.expr | ast.stmt, ast.expr | ast.stmt]]:
    match node:
        case ast.BinOp(left=left, op=ast.MatMult(), right=right):
            yield node, ast.BinOp(right, ast.MatMult(), left)
        case ast.BinOp(left=left, op=op, right=right) if type(op) in _OPERATORS:
            yield node, ast.BinOp(left, _OPERATORS[type(op)](), right)
        case ast.AugAssign(target=target, op=op, value=value) if type(op) in _OPERATORS:
            yield node, ast.AugAssign(target, _OPERATORS[type(op)](), value)
        case ast.UnaryOp(op=ast.USub() | ast.Not() | ast.Invert(), operand=operand):
            yield node, operand
        case ast.BoolOp(op=op, values=values):
            yield node, ast.BoolOp(ast.Or() if isinstance(op, ast.And) else ast.And(), values)
        case ast.Compare(left=left, ops=ops, comparators=comparators):
            for n, comparison in enumerate(ops):
                for other in _COMPARISONS[type(comparison)]:
                    yield node, ast.Compare(left, [*ops[:n], other(), *ops[n + 1 :]], comparators)
        case ast.IfExp(test=test, body=body, orelse=orelse):
            yield node, ast.IfExp(test, orelse, body)
        case ast.If(test=test) if not isinstance(test, ast.Compare | ast.UnaryOp):
            yield test, ast.UnaryOp(ast.Not(), test)
        case ast.Attribute(value=value, attr="T"):
            yield node, value
        case ast.Slice(lower=lower, upper=upper, step=step):
            if lower is not None:
                yield node, ast.Slice(None, upper, step)
            if upper is not None:
                yield node, ast.Slice(lower, None, step)
        case ast.Constant(value=bool(value)):
            yield node, ast.Constant(not value)
        case ast.Constant(value=int(value) | float(value)):
            yield node, ast.Constant(_other_number(value, index))
        case ast.Call(func=func, args=[first, second, *rest], keywords=keywords) if _name(func) in _ORDERED:
            yield node, ast.Call(func, [second, first, *rest], keywords)
        case ast.Call(func=func, args=args, keywords=keywords) if _name(func) in _FUNCTIONS:
            yield node, ast.Call(_renamed(func, _FUNCTIONS[_name(func)]), args, keywords)


def _other_number(value: float, index: bool) -> float:
    """A number that is not the same; of indices the one before, which is there too."""
    if index and isinstance(value, int):
        return value - 1 if value > 0 else 1
    if isinstance(value, int):
        return value + 1
    return 2.0 * value if value else 1.0


def _name(func: ast.expr) -> str:
    match func:
        case ast.Name(id=name) | ast.Attribute(attr=name):
            return name
    return ""


def _renamed(func: ast.expr, name: str) -> ast.expr:
    return ast.Attribute(func.value, name) if isinstance(func, ast.Attribute) else ast.Name(name)
