"""One bad input, and the wrong values that most of them are made of."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

# Values that are not what a parameter of that type takes, as source code.
WHOLE = (
    "None", "'3'", "2.5", "nan", "inf", "-1", "True", "[1]", "{}", "10**30", "10**5000", "1j",
    "object()", "np.array([1, 2])",
)  # fmt: skip
REAL = (
    "None", "'0.3'", "nan", "True", "[0.3]", "{}", "1j", "object()", "-1.0", "10**400",
    "np.array([0.1, 0.2])", "b'1'",
)  # fmt: skip
BOOL = ("'no'", "2", "None", "0.5", "[True]", "nan", "object()")
TEXT = ("'bogus'", "''", "3", "b'V'", "['V']", "object()", "{}")
OBJECT = ("3", "'x'", "{}", "[]", "object()", "int")
SEED = ("-1", "'x'", "2.5", "nan", "[1, 2]", "{'a': 1}", "10**5000", "object()", "1j", "True")
RASTER = (
    "None", "3", "'x'", "[[0, 2]]", "[[0.5]]", "[[nan] * 4]", "[[0, 1], [0]]", "{}", "object()",
    "np.zeros((0, 4))", "np.zeros((3, 0))", "np.zeros((2, 2, 2, 2))", "[['a'] * 4]",
    "np.zeros((3, 4), complex)", "np.full((3, 4), -1)", "np.full((3, 4), 256)",
)  # fmt: skip
ROW = (
    "[0.5]", "['a']", "[nan]", "[-1]", "[2**62]", "[2**70]", "[[0]]", "[[0], [1, 2]]", "object()",
    "{}", "'text'", "[None]", "[True]", "3.5",
)  # fmt: skip
ACTION = (
    "2", "-1", "256", "0.5", "nan", "None", "'1'", "[0, 1]", "[]", "{}", "object()", "1j", "1e300",
    "2**70", "np.array([0, 1])", "b'1'",
)  # fmt: skip
OBSERVATION = (
    "None", "'0001'", "np.zeros(3)", "np.zeros(5)", "np.zeros((1, 4))", "np.full(4, 0.5)",
    "np.full(4, nan)", "np.full(4, 256)", "np.full(4, -1)", "np.full(4, 2)", "[]", "{}", "object()",
    "['a'] * 4", "np.zeros(4, complex)", "7", "np.zeros(4, object)", "[[0], [1, 2]]",
)  # fmt: skip


@dataclass(frozen=True)
class Case:
    """One bad input.

    Attributes:
        name: what is wrong.
        owner: the file that ought to refuse it.
        code: the lines.
        fine: whether to take it is as good as to refuse it.
    """

    name: str
    owner: str
    code: str
    fine: bool = False


def of(owner: str, template: str, values: tuple[str, ...] | list[str]) -> list[Case]:
    """`template` once for each value, in the place of «»."""
    return [Case(template.replace("«»", v), owner, template.replace("«»", v)) for v in values]


def fine(cases: list[Case], *values: str) -> list[Case]:
    """The same, those with one of these values being as good taken as refused."""
    return [
        dataclasses.replace(case, fine=case.fine or any(v in case.code for v in values))
        for case in cases
    ]
