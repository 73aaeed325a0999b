"""Parameters of OpenSCENARIO, and the ${expressions} over them.

Source: ASAM OpenSCENARIO XML 1.3, section 9.1 to 9.3.
"""

import ast
import math
import operator
import re
from collections.abc import Callable, Mapping
from typing import Any
from xml.etree.ElementTree import Element

from augment.foreign import Doubts, fault_at

Values = Mapping[str, str]

_LONGEST = 500
"""Characters of an expression."""
_NAME = re.compile(r"\$([A-Za-z_]\w*)")
_OPERATORS: dict[type[ast.AST], Callable[..., Any]] = {
    **{ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul},
    **{ast.Div: operator.truediv, ast.Mod: math.fmod, ast.Pow: math.pow},
    **{ast.USub: operator.neg, ast.UAdd: operator.pos, ast.Not: operator.not_},
    **{ast.Eq: operator.eq, ast.NotEq: operator.ne, ast.Lt: operator.lt, ast.LtE: operator.le},
    **{ast.Gt: operator.gt, ast.GtE: operator.ge},
}
_FUNCTIONS: dict[str, Callable[..., Any]] = {
    **{name: getattr(math, name) for name in ("floor", "ceil", "sqrt", "sin", "cos", "tan")},
    **{name: getattr(math, name) for name in ("asin", "acos", "atan", "pow")},
    **{"abs": abs, "min": min, "max": max},
    "round": lambda value: math.copysign(math.floor(abs(value) + 0.5), value),
    "sign": lambda value: math.copysign(1.0, value) if value else 0.0,
}


def resolve(
    element: Element, values: Values, doubts: Doubts, assigned: Values | None = None
) -> Element:
    """Return a copy in which parameters and expressions are replaced by their values.

    Args:
        element: May declare parameters for what is in it.
        values: Of the parameters around it.
        doubts: Told of what is unknown or has no value, and stays as it is.
        assigned: Values that replace those which it declares.
    """

    def read(text: str, place: str) -> str:
        value = doubts.read("parameters", resolve_text, text, values, place)
        return text if value is None else value

    for declared in element.findall("ParameterDeclarations/ParameterDeclaration"):
        name = declared.get("name", "").removeprefix("$")
        own = read(declared.get("value", ""), f"parameter {name[:40]}")
        values = {**values, name: (assigned or {}).get(name, own)}
    copy = Element(element.tag)
    for name, text in element.items():
        place = f"{element.tag}.{name}"
        # What is assigned to is a name in the entry; nothing goes by a condition's.
        is_name = place in ("ParameterAssignment.parameterRef", "Condition.name")
        copy.set(name, text if is_name else read(text, place))
    copy.text = element.text
    for child in element:
        if child.tag != "ParameterDeclarations":
            copy.append(resolve(child, values, doubts))
    return copy


def resolve_text(text: str, values: Values, place: str) -> str:
    """Return a text, or the value of the parameter or expression that it is.

    Raises:
        InvalidDocument: A parameter is unknown, or an expression has no value.
    """
    if not text.startswith("$"):
        return text
    if not text.startswith("${"):
        return _look_up(text[1:], values, place)
    body = text[2:-1]
    if not text.endswith("}") or len(body) > _LONGEST:
        raise fault_at(place, f"needs ${{...}} of at most {_LONGEST} characters")
    names = {f"_{name}": _look_up(name, values, place) for name in _NAME.findall(body)}
    try:
        tree = ast.parse(_NAME.sub(r"_\1", body.strip()), mode="eval")
        value = _evaluate(tree.body, {name: _constant(text) for name, text in names.items()})
        if isinstance(value, bool):
            return str(value).lower()
        if not math.isfinite(value):
            raise ValueError("is not finite")
        return f"{value:.17g}"
    except (ArithmeticError, LookupError, SyntaxError, TypeError, ValueError) as fault:
        raise fault_at(place, f"{body[:60]!r} has no value: {fault}") from None


# Private


def _look_up(name: str, values: Values, place: str) -> str:
    if name not in values:
        known = ", ".join([*values][:20]) or "none"
        raise fault_at(place, f"unknown parameter {name[:40]!r}; known here: {known}")
    return values[name]


def _constant(text: str) -> float | bool:
    return {"true": True, "false": False}[text] if text in ("true", "false") else float(text)


def _evaluate(node: ast.AST, names: Mapping[str, float | bool]) -> Any:
    """The value of a node; nothing but numbers, names, operators and functions has one."""
    match node:
        case ast.Constant(value=bool() | int() | float() as value):
            return float(value) if not isinstance(value, bool) else value
        case ast.Name(id=name):
            return {"true": True, "false": False, **names}[name]
        case ast.UnaryOp(op=op, operand=operand):
            return _OPERATORS[type(op)](_evaluate(operand, names))
        case ast.BinOp(left=left, op=op, right=right):
            return _OPERATORS[type(op)](_evaluate(left, names), _evaluate(right, names))
        case ast.Compare(left=left, ops=[op], comparators=[right]):
            return _OPERATORS[type(op)](_evaluate(left, names), _evaluate(right, names))
        case ast.BoolOp(op=op, values=parts):
            return (all if isinstance(op, ast.And) else any)(_evaluate(p, names) for p in parts)
        case ast.Call(func=ast.Name(id=name), args=args, keywords=[]):
            return _FUNCTIONS[name](*(_evaluate(part, names) for part in args))
    raise ValueError("it holds more than numbers, operators and functions")
