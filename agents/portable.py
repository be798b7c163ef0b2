"""A step or a teaching signal that a user writes for plain numbers, made to serve lanes as well.

Python's `and`, `or`, `not`, chained comparisons and `x if condition else y` ask for one truth
value, and neurons side by side have one each. Here such expressions are rewritten, before
compilation, into the functions of `agents.simd` that mean the same in every lane:

    a and b, a or b, not a      a & b, a | b, negated(a)
    low < V <= high             (low < V) & (V <= high)
    x if condition else y       where(condition, x, y)

What has no such meaning, an `if` or a `while` that depends on the neuron, is refused in a sentence.
"""

from __future__ import annotations

import ast
import inspect
import textwrap
import types
from typing import Any

from numba.core.dispatcher import Dispatcher

from agents import simd
from gnm_env.compiled import compiled

_NAMES = {"__where": simd.where, "__negated": simd.negated}


def portable(function: Any) -> Any:
    """`function`, rewritten as the module says where that is needed, compiled.

    A function that is compiled already, or whose source is not to be had, is taken as it is.
    Raises ValueError, naming file and line, for what cannot serve neurons side by side.
    """
    if isinstance(function, Dispatcher):
        return function
    try:
        source = textwrap.dedent(inspect.getsource(function))
    except (OSError, TypeError):
        return compiled(function)
    tree = ast.parse(source)
    definition = tree.body[0]
    if not isinstance(definition, ast.FunctionDef):
        return compiled(function)
    rewriter = _Rewriter(function)
    definition.body = [rewriter.visit(statement) for statement in definition.body]
    if not rewriter.changed:
        return compiled(function)
    return compiled(_rebuilt(function, tree, definition))


def _rebuilt(function: Any, tree: ast.Module, definition: ast.FunctionDef) -> Any:
    """The function of the rewritten `definition`, with the names and the lines of the original."""
    code = function.__code__
    definition.decorator_list = []
    definition.returns = None
    for argument in definition.args.args:
        argument.annotation = None
    if code.co_freevars:  # what the function takes from the function around it
        source = f"def _maker({', '.join(code.co_freevars)}):\n    return {definition.name}"
        maker: Any = ast.parse(source).body[0]
        maker.body.insert(0, definition)
        tree.body = [maker]
    ast.fix_missing_locations(tree)
    ast.increment_lineno(tree, code.co_firstlineno - 1)
    space = {**function.__globals__, **_NAMES}
    exec(compile(tree, code.co_filename, "exec"), space)
    if code.co_freevars:
        cells = (cell.cell_contents for cell in function.__closure__)
        made = space["_maker"](*cells)
    else:
        made = space[definition.name]
    # The module's own names, so that those defined later are found.
    function.__globals__.update(_NAMES)
    made = types.FunctionType(
        made.__code__,
        function.__globals__,
        function.__name__,
        function.__defaults__,
        made.__closure__,
    )
    made.__qualname__, made.__module__ = function.__qualname__, function.__module__
    made.__doc__ = function.__doc__
    return made


class _Rewriter(ast.NodeTransformer):
    def __init__(self, function: Any) -> None:
        self.changed = False
        self._code = function.__code__
        self._name = function.__qualname__

    def visit_BoolOp(self, node: ast.BoolOp) -> ast.AST:
        self.generic_visit(node)
        operator = ast.BitAnd() if isinstance(node.op, ast.And) else ast.BitOr()
        return self._joined(node, operator, node.values)

    def visit_UnaryOp(self, node: ast.UnaryOp) -> ast.AST:
        self.generic_visit(node)
        if not isinstance(node.op, ast.Not):
            return node
        return self._call(node, "__negated", node.operand)

    def visit_Compare(self, node: ast.Compare) -> ast.AST:
        self.generic_visit(node)
        if len(node.ops) == 1:
            return node
        terms = [node.left, *node.comparators]
        pairs = [
            ast.Compare(left, [operator], [right])
            for left, operator, right in zip(terms, node.ops, terms[1:], strict=False)
        ]
        return self._joined(node, ast.BitAnd(), pairs)

    def visit_IfExp(self, node: ast.IfExp) -> ast.AST:
        if self._is_static(node.test):
            return self.generic_visit(node)
        self.generic_visit(node)
        return self._call(node, "__where", node.test, node.body, node.orelse)

    def visit_If(self, node: ast.If) -> ast.AST:
        if not self._is_static(node.test):
            self._refuse(node, "if …:", "x = new if condition else x, which is done in every lane")
        return self.generic_visit(node)

    def visit_While(self, node: ast.While) -> ast.AST:
        self._refuse(node, "while …:", "a for loop over a fixed range")
        return node

    def _joined(self, node: ast.AST, operator: ast.operator, values: list[Any]) -> ast.AST:
        self.changed = True
        result = values[0]
        for value in values[1:]:
            result = ast.BinOp(result, operator, value)
        return ast.copy_location(result, node)

    def _call(self, node: ast.AST, name: str, *arguments: ast.expr) -> ast.AST:
        self.changed = True
        call = ast.Call(ast.Name(name, ast.Load()), list(arguments), [])
        return ast.copy_location(call, node)

    def _refuse(self, node: Any, what: str, instead: str) -> None:
        line = self._code.co_firstlineno + node.lineno - 1
        raise ValueError(
            f"{self._code.co_filename}, line {line}, in {self._name}: `{what}` cannot serve "
            f"neurons side by side, each of which may go another way; write {instead}"
        )

    def _is_static(self, test: ast.expr) -> bool:
        """Whether a condition is the same for all neurons: it asks for `static` or for globals."""
        own = set(self._code.co_varnames) - {"static"}
        return all(node.id not in own for node in ast.walk(test) if isinstance(node, ast.Name))
