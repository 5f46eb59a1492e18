"""Mutant schemata: C sources in which every mutant is an expression that a global number selects at run time.

`a + b` becomes `(MUTANT(17) ? (a - b) : (a + b))`. Only one mutant is active at a time, so the mutated side contains
the original text of its operands, and the text grows linearly. Constant expressions stay unchanged.
"""

import re
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import tree_sitter_c
from tree_sitter import Language, Node, Parser

ARITHMETIC = {
    "+": "-", "-": "+", "*": "/", "/": "*", "%": "*", "<<": ">>", ">>": "<<", "&": "|", "|": "&", "^": "&",
}  # fmt: skip
RELATIONAL = {"<": "<=", "<=": "<", ">": ">=", ">=": ">", "==": "!=", "!=": "=="}
LOGICAL = {"&&": "||", "||": "&&"}
ASSIGNMENT = {"+=": "-=", "-=": "+=", "*=": "/=", "/=": "*=", "%=": "*=", "<<=": ">>=", ">>=": "<<=", "&=": "|=",
              "|=": "&=", "^=": "&="}  # fmt: skip
# When an operator and its replacement have different results, by the operands l_ and r_. 1: always, to be short.
DIFFERENT = {
    "+": "r_ != 0", "-": "r_ != 0", "*": "1", "/": "1", "%": "1", "<<": "(l_ != 0) && (r_ != 0)",
    ">>": "(l_ != 0) && (r_ != 0)", "&": "l_ != r_", "|": "l_ != r_", "^": "1",
}  # fmt: skip
UPDATE = {"++": "--", "--": "++"}
LOOPS = ("for_statement", "while_statement", "do_statement")
# Subtrees that must be constant for the compiler, or that are not expressions.
CONSTANT = ("sizeof_expression", "type_descriptor", "attribute_specifier", "subscript_designator", "static_assert",
            "preproc_call", "preproc_include", "preproc_def", "alignof_expression", "comment")  # fmt: skip
# Names of a local count of saturations. Where the function only hands it on (`&held`), nothing reads it: num.h adds to
# it alone. So its start makes no difference and is no mutant.
COUNTS = ("held", "ignored", "saturations")
MACRO = re.compile(r"^[ \t]*#[ \t]*define[ \t]+([A-Z][A-Z0-9_]+)[ \t]+(\(?-?(?:NUM\()?[0-9.])?", re.MULTILINE)


@dataclass(frozen=True)
class Mutant:
    """One change. `file` is a path below firmware/; `occurrence` counts equal changes within a function, from 1."""

    number: int
    file: str
    function: str
    change: str
    occurrence: int
    line: int

    @property
    def key(self) -> str:
        return f"{self.file}:{self.function}: {self.change} #{self.occurrence}"


def numeric_macros(files: list[Path]) -> set[str]:
    """Macros that are a number in each of their definitions. They are mutated where an expression uses them."""
    found = [match for file in files for match in MACRO.findall(file.read_text())]
    return {name for name, number in found if number} - {name for name, number in found if not number}


class Schemata:
    """Instruments one file after the other; numbers run through all of them, from 1."""

    def __init__(self, constants: set[str]) -> None:
        self.parser = Parser(Language(tree_sitter_c.language()))
        self.constants = constants
        self.mutants: list[Mutant] = []

    def instrument(self, name: str, text: str) -> str:
        self.file, self.bytes = name, text.encode()
        self.seen: Counter[tuple[str, str]] = Counter()
        return self.outside(self.parser.parse(self.bytes).root_node)

    # Outside of functions nothing changes.
    def outside(self, node: Node) -> str:
        if node.type == "function_definition":
            body = node.child_by_field_name("body")
            declarator = node.child_by_field_name("declarator")
            assert body is not None
            assert declarator is not None
            names = re.findall(r"(\w+)\s*\(", self.text(declarator))
            self.function = names[0] if names else self.text(declarator)
            self.unread = {name for name in COUNTS if self.is_unread(name, self.text(body))}
            return self.between(node, {body.id: self.rewritten(body)})
        return self.between(node, {child.id: self.outside(child) for child in node.children if child.child_count})

    def text(self, node: Node) -> str:
        return self.bytes[node.start_byte : node.end_byte].decode()

    def between(self, node: Node, parts: dict[int, str]) -> str:
        """The node's text with some children replaced."""
        result, at = [], node.start_byte
        for child in node.children:
            if child.id in parts:
                result += [self.bytes[at : child.start_byte].decode(), parts[child.id]]
                at = child.end_byte
        return "".join([*result, self.bytes[at : node.end_byte].decode()])

    def number_of(self, node: Node, new: str) -> int:
        change = " ".join(f"{self.text(node)} -> {new}".split())
        self.seen[self.function, change] += 1
        line = node.start_point[0] + 1
        occurrence = self.seen[self.function, change]
        self.mutants.append(Mutant(len(self.mutants) + 1, self.file, self.function, change, occurrence, line))
        return len(self.mutants)

    def choice(self, node: Node, alternatives: list[str], rest: str) -> str:
        """An expression that is one of the alternatives if that mutant is active, and `rest` otherwise."""
        for new in reversed(alternatives):
            rest = f"(MUTANT({self.number_of(node, new)}) ? ({new}) : ({rest}))"
        return rest

    def inside(self, node: Node) -> str:
        """The node with its children rewritten, itself unchanged."""
        return self.between(node, {child.id: self.rewritten(child) for child in node.named_children})

    def rewritten(self, node: Node) -> str:
        kind = node.type
        if kind in CONSTANT or (kind == "declaration" and (self.is_static(node) or self.is_unread_count(node))):
            return self.text(node)
        if kind == "case_statement":
            value = node.child_by_field_name("value")
            return self.between(
                node, {child.id: self.rewritten(child) for child in node.named_children if child != value}
            )
        if kind == "array_declarator":
            return self.text(node)
        if kind in ("preproc_if", "preproc_elif"):
            condition = node.child_by_field_name("condition")
            return self.between(
                node, {child.id: self.rewritten(child) for child in node.named_children if child != condition}
            )
        if kind in LOOPS or kind in ("if_statement", "conditional_expression"):
            return self.with_condition(node)
        if kind == "binary_expression":
            return self.binary(node)
        if kind in ("unary_expression", "update_expression", "assignment_expression"):
            return self.operator(node)
        if kind == "number_literal" or (kind == "identifier" and self.text(node) in self.constants):
            return self.choice(node, [f"{self.text(node)} + 1"], self.text(node))
        return self.inside(node)

    def is_unread(self, name: str, body: str) -> bool:
        """Every use is `&name` as an argument, except for its declarations."""
        code = re.sub(r"/\*.*?\*/", "", body, flags=re.DOTALL)
        handed_on = len(re.findall(rf"[(,]\s*&{name}\s*[,)]", code))
        declared = len(re.findall(rf"\buint32_t {name} = 0;", code))
        return declared > 0 and len(re.findall(rf"\b{name}\b", code)) == handed_on + declared

    def is_unread_count(self, node: Node) -> bool:
        return self.text(node) in {f"uint32_t {name} = 0;" for name in self.unread}

    def is_static(self, node: Node) -> bool:
        return any(child.type == "storage_class_specifier" for child in node.children)

    def with_condition(self, node: Node) -> str:
        condition = node.child_by_field_name("condition")
        parts = {child.id: self.rewritten(child) for child in node.named_children if child != condition}
        if condition is not None:
            inner = self.condition(condition, self.matters(node))
            parts[condition.id] = f"(MUTANT_STEP(), {inner})" if node.type in LOOPS else inner
            if node.type in ("if_statement", "while_statement", "do_statement") and not parts[condition.id].startswith(
                "("
            ):
                parts[condition.id] = f"({parts[condition.id]})"
        return self.between(node, parts)

    def matters(self, node: Node) -> str:
        """Whether the two values of `a < b ? a : b` differ. If not, then no mutant of the comparison does anything."""
        parts = [node.child_by_field_name(name) for name in ("condition", "consequence", "alternative")]
        if node.type != "conditional_expression" or any(part is None for part in parts):
            return "1"
        condition, *values = [self.text(part) for part in parts if part is not None]
        # Only values that can be computed whatever the condition says.
        if all(re.fullmatch(r"\w+", value) or (self.is_safe(part) and value in condition)
               for value, part in zip(values, parts[1:], strict=True) if part is not None):  # fmt: skip
            return f"({values[0]}) != ({values[1]})"
        return "1"

    def condition(self, node: Node, matters: str = "1") -> str:
        """A condition: mutated to true, to false, and in its parts."""
        if node.type == "parenthesized_expression":
            return self.between(node, {child.id: self.condition(child, matters) for child in node.named_children})
        if node.type == "binary_expression":
            return self.binary(node, matters)
        rest = self.rewritten(node)
        zero, one = self.number_of(node, "0"), self.number_of(node, "1")
        return f"MUTANT_CONDITION({one}, {zero}, ({rest}))"

    def binary(self, node: Node, matters: str = "1") -> str:
        left, right = node.child_by_field_name("left"), node.child_by_field_name("right")
        sign = node.child_by_field_name("operator")
        assert left is not None
        assert right is not None
        assert sign is not None
        operator = sign.type
        if operator in LOGICAL:
            first, second = self.condition(left), self.condition(right)
            number = self.number_of(node, self.between(node, {sign.id: LOGICAL[operator]}))
            is_safe = self.is_safe(right) and "NULL" not in self.text(left)
            macro = ("MUTANT_AND" if operator == "&&" else "MUTANT_OR") + ("" if is_safe else "_LAZY")
            return f"{macro}({number}, ({first}), ({second}), ({self.text(right)}))"
        first = self.rewritten(left)
        if operator not in RELATIONAL:
            second = self.rewritten(right)
            new = ARITHMETIC[operator]
            number = self.number_of(node, self.between(node, {sign.id: new}))
            return f"MUTANT_ARITHMETIC({number}, ({first}), {operator}, {new}, ({second}), {DIFFERENT[operator]})"
        constant = self.constant_plus_one(right)
        second = self.text(right) if constant else self.rewritten(right)
        one_more = f"{self.number_of(constant, self.text(constant) + ' + 1')}" if constant else "0"
        text = self.text(constant) if constant else ""
        larger = self.text(right).replace(text, f"{text} + 1") if constant else "0"
        zero, one = self.number_of(node, "0"), self.number_of(node, "1")
        other = self.number_of(node, self.between(node, {sign.id: RELATIONAL[operator]}))
        return (
            f"MUTANT_COMPARISON({other}, {one}, {zero}, {one_more}, ({first}), {operator}, {RELATIONAL[operator]}, "
            f"({second}), ({larger}), ({matters}))"
        )

    def constant_plus_one(self, node: Node) -> Node | None:
        """The number in `3u`, `LIMIT` or `NUM(0.5)`."""
        if node.type == "call_expression" and self.text(node).startswith("NUM("):
            arguments = node.child_by_field_name("arguments")
            assert arguments is not None
            only = arguments.named_children[0]
            return only if only.type == "number_literal" else None
        is_number = node.type == "number_literal" or (node.type == "identifier" and self.text(node) in self.constants)
        return node if is_number else None

    def is_safe(self, node: Node) -> bool:
        """Evaluation has no side effect and cannot trap, whatever the operand before it says."""
        return re.fullmatch(r"[\w\s().<>=!&|]*", self.text(node).replace("->", ".")) is not None and not re.search(
            r"\w\s*\(|<<|>>|[^=!<>]=[^=]|(?<!&)&(?!&)", self.text(node).replace("->", ".")
        )

    def operator(self, node: Node) -> str:
        sign = node.child_by_field_name("operator")
        assert sign is not None
        rest = self.inside(node)
        if node.type == "unary_expression":
            argument = node.child_by_field_name("argument")
            assert argument is not None
            if sign.type == "+" or (sign.type == "-" and argument.type == "number_literal"):
                return rest
            return self.choice(node, [self.text(argument)], rest)
        table = UPDATE if node.type == "update_expression" else ASSIGNMENT
        if sign.type not in table:
            return rest
        return self.choice(node, [self.between(node, {sign.id: table[sign.type]})], rest)
