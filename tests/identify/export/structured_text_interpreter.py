"""A small interpreter of structured text, written from the standard's grammar and not from the exporter.

It knows what the third edition of IEC 61131-3 has of expressions, assignments, FOR, IF, arrays, functions and one function
block, and nothing else; whatever else stands in a text is an error.
"""

from __future__ import annotations

import math
import re

TOKEN = re.compile(
    r"\s*(?:(?P<comment>\(\*.*?\*\))|(?P<number>\d+\.\d+(?:E[+-]?\d+)?|\d+)|(?P<name>[A-Za-z_]\w*)|(?P<op>:=|<=|>=|<>|\.\.|[-+*/()\[\],;:<>=]))",
    re.DOTALL,
)
STANDARD = {
    "ABS": abs,
    "EXP": math.exp,
    "LN": math.log,
    "SQRT": math.sqrt,
    "SIN": math.sin,
    "COS": math.cos,
    "TAN": math.tan,
    "ATAN": math.atan,
    "MIN": min,
    "MAX": max,
    "EXPT": math.pow,
}


def tokens(text):
    found, place = [], 0
    while place < len(text):
        match = TOKEN.match(text, place)
        if match is None:
            if not text[place:].strip():
                break
            raise SyntaxError(f"not structured text: {text[place : place + 30]!r}")
        place = match.end()
        if match.lastgroup != "comment":
            found.append((match.lastgroup, match.group(match.lastgroup)))
    return found


class Parser:
    """Turns a text into functions and a block."""

    def __init__(self, text):
        self.tokens, self.at = tokens(text), 0

    def peek(self):
        return self.tokens[self.at][1] if self.at < len(self.tokens) else None

    def take(self, wanted=None):
        text = self.tokens[self.at][1]
        if wanted is not None and text != wanted:
            raise SyntaxError(f"expected {wanted}, got {text}")
        self.at += 1
        return text

    def program(self):
        units = {}
        while self.peek() is not None:
            kind = self.take()
            if kind not in ("FUNCTION", "FUNCTION_BLOCK"):
                raise SyntaxError(f"expected a function or a function block, got {kind}")
            name = self.take()
            if kind == "FUNCTION":
                self.take(":")
                self.take()
            variables, inputs = {}, []
            while self.peek() in ("VAR", "VAR_INPUT", "VAR_OUTPUT"):
                section = self.take()
                while self.peek() != "END_VAR":
                    for own, value in self.declaration():
                        variables[own] = value
                        if section == "VAR_INPUT":
                            inputs.append(own)
                self.take("END_VAR")
            body = self.statements(f"END_{kind}")
            self.take(f"END_{kind}")
            units[name] = (kind, variables, inputs, body)
        return units

    def declaration(self):
        names = [self.take()]
        while self.peek() == ",":
            self.take()
            names.append(self.take())
        self.take(":")
        shape = None
        if self.peek() == "ARRAY":
            self.take()
            self.take("[")
            shape = []
            while True:
                low = int(self.take())
                self.take("..")
                shape.append((low, int(self.take())))
                if self.take() == "]":
                    break
            self.take("OF")
        kind = self.take()
        start = {"LREAL": 0.0, "INT": 0, "BOOL": False}[kind]
        if shape is None:
            value = start
            if self.peek() == ":=":
                self.take()
                value = self.expression()({}, {})
        else:
            places = [()]
            for low, high in shape:
                places = [(*place, index) for place in places for index in range(low, high + 1)]
            value = dict.fromkeys(places, start)
            if self.peek() == ":=":
                self.take()
                self.take("[")
                for index, place in enumerate(places):
                    if index:
                        self.take(",")
                    value[place] = self.expression()({}, {})
                self.take("]")
        self.take(";")
        return [(name, dict(value) if isinstance(value, dict) else value) for name in names]

    def statements(self, *ends):
        found = []
        while self.peek() not in ends:
            found.append(self.statement())
        return found

    def statement(self):
        if self.peek() == "FOR":
            self.take()
            name = self.take()
            self.take(":=")
            first = self.expression()
            self.take("TO")
            last = self.expression()
            step = None
            if self.peek() == "BY":
                self.take()
                step = self.expression()
            self.take("DO")
            body = self.statements("END_FOR")
            self.take("END_FOR")
            self.take(";")

            def loop(variables, units):
                by = 1 if step is None else step(variables, units)
                value, end = first(variables, units), last(variables, units)
                while (value <= end) if by > 0 else (value >= end):
                    variables[name] = value
                    for own in body:
                        own(variables, units)
                    value += by

            return loop
        if self.peek() == "IF":
            branches, otherwise = [], []
            self.take()
            while True:
                test = self.expression()
                self.take("THEN")
                branches.append((test, self.statements("ELSIF", "ELSE", "END_IF")))
                word = self.take()
                if word == "ELSE":
                    otherwise = self.statements("END_IF")
                    self.take("END_IF")
                if word != "ELSIF":
                    break
            self.take(";")

            def choose(variables, units):
                chosen = next((body for test, body in branches if test(variables, units)), otherwise)
                for own in chosen:
                    own(variables, units)

            return choose
        name, places = self.take(), None
        if self.peek() == "[":
            places = self.places()
        self.take(":=")
        value = self.expression()
        self.take(";")

        def assign(variables, units):
            if name not in variables:
                raise NameError(name)
            if places is None:
                variables[name] = value(variables, units)
            else:
                place = tuple(own(variables, units) for own in places)
                if place not in variables[name]:
                    raise IndexError(f"{name}{place}")
                variables[name][place] = value(variables, units)

        return assign

    def places(self):
        self.take("[")
        found = [self.expression()]
        while self.peek() == ",":
            self.take()
            found.append(self.expression())
        self.take("]")
        return found

    def expression(self):
        left = self.sum()
        if self.peek() in ("<", ">", "<=", ">=", "=", "<>"):
            sign, right = self.take(), self.sum()
            compare = {
                "<": lambda a, b: a < b,
                ">": lambda a, b: a > b,
                "<=": lambda a, b: a <= b,
                ">=": lambda a, b: a >= b,
                "=": lambda a, b: a == b,
                "<>": lambda a, b: a != b,
            }[sign]
            return lambda variables, units: compare(left(variables, units), right(variables, units))
        return left

    def sum(self):
        value = self.product()
        while self.peek() in ("+", "-"):
            sign, left, right = (1 if self.take() == "+" else -1), value, self.product()
            value = lambda v, u, a=left, b=right, s=sign: a(v, u) + s * b(v, u)  # noqa: E731
        return value

    def product(self):
        value = self.factor()
        while self.peek() in ("*", "/"):
            times, left, right = self.take() == "*", value, self.factor()
            value = lambda v, u, a=left, b=right, t=times: a(v, u) * b(v, u) if t else a(v, u) / b(v, u)  # noqa: E731
        return value

    def factor(self):
        kind, text = self.tokens[self.at]
        self.at += 1
        if text == "-":
            inner = self.factor()
            return lambda v, u: -inner(v, u)
        if text == "NOT":
            inner = self.factor()
            return lambda v, u: not inner(v, u)
        if text == "(":
            inner = self.expression()
            self.take(")")
            return inner
        if kind == "number":
            number = float(text) if "." in text else int(text)
            return lambda v, u: number
        if text in ("TRUE", "FALSE"):
            return lambda v, u: text == "TRUE"
        if kind != "name":
            raise SyntaxError(f"unexpected {text}")
        if self.peek() == "(":
            self.take()
            arguments = [self.expression()]
            while self.peek() == ",":
                self.take()
                arguments.append(self.expression())
            self.take(")")
            return lambda v, u: call(u, text, [own(v, u) for own in arguments])
        if self.peek() == "[":
            places = self.places()
            return lambda v, u: v[text][tuple(own(v, u) for own in places)]
        return lambda v, u: v[text]


def call(units, name, arguments):
    if name in STANDARD:
        return STANDARD[name](*arguments)
    _, variables, inputs, body = units[name]
    own = {key: dict(value) if isinstance(value, dict) else value for key, value in variables.items()}
    own.update(zip(inputs, arguments, strict=True))
    own[name] = 0.0
    for statement in body:
        statement(own, units)
    return own[name]


class Block:
    """An instance of the function block of a text; its variables stay from call to call."""

    def __init__(self, text, name):
        self.units = Parser(text).program()
        _, variables, self.inputs, self.body = self.units[name]
        self.variables = {k: dict(v) if isinstance(v, dict) else v for k, v in variables.items()}

    def __call__(self, **inputs):
        for name, value in inputs.items():
            if name not in self.inputs:
                raise NameError(name)
            self.variables[name] = (
                {(index,): float(own) for index, own in enumerate(value)}
                if hasattr(value, "__len__")
                else value
            )
        for statement in self.body:
            statement(self.variables, self.units)
        return self.variables
