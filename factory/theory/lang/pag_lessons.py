"""Mistakes in PAGs: malformed statements, and the message for each.

In a message or hint `{found}` is the token at which the parser stops, `{before}` the one before it,
`{first}` the statement's first and `{operation}` the word before its first parenthesis.
"""

from __future__ import annotations

from factory.theory.lang.recovery import Lesson

FORM = "a statement reads: label = operation ( input, ..., parameter = value );"
ARGUMENTS = "arguments lie between commas: mate ( sub1, part2, name = value )"
NUMBERS = "numbers lie between commas in parentheses: pos = ( 0, 0, 0.1 )"
COPIES = "copies of a part: screw[2] = atomic ( ... ) at ( 0, 0, 0 ), ( 0, 0, 0.1 );"
VALUE = 'a value is a number, a text "..." or numbers in parentheses ( 0, 0, 1 )'

ALLOWED = "an overlap of two parts is allowed up to a depth: allow ( peg, frame, 0.0005 );"

FALLBACK = Lesson("unexpected {found}", FORM, "found", "")
FALSE_UNIT = Lesson(
    "unexpected {found} after the unit", "write one of m, cm, mm, in: unit = mm;", "found", ""
)
FALSE_PLACE = Lesson(
    "missing ',' before {found}",
    "places lie between commas: at ( 0, 0, 0 ), ( 0, 0, 0.1 )",
    "behind",
    "",
)
FALSE_MIX = Lesson(
    "unexpected {found} in the mix of products",
    "write how many of each: mix = 3 truck, 1 van; or the order: mix = truck, truck, van;",
    "found",
    "",
)
FALSE_ROOT = Lesson("unexpected {found} after the root", "write: root = label;", "found", "")

LESSONS = (
    Lesson(
        "unexpected {found} in what is allowed",
        ALLOWED,
        "found",
        'allow ( ) | allow ( , a ) | allow ( a , ) | allow ( a b | allow ( a "b" | allow ( a = b | '
        'allow ( "a" | allow ( ( a | allow ( a ( | allow ( = | allow ( a , , b | allow ( a , ( b | '
        'allow ( a , "b" | allow ( a , = 1 | allow ( ; a | allow ( a ; b | allow ( a , ; b | '
        "allow ( [2] | allow ( a , [2] | allow ( a ) b | allow ( a ) = b | allow ( a ) ( b | "
        'allow ( a ) ) | allow ( a ) , b | allow ( a ) "b" | allow ( a ) [2]',
    ),
    Lesson(
        "missing ')': what is allowed is not closed",
        ALLOWED,
        "behind",
        "allow ( | allow ( a | allow ( a , | allow ( a , b c",
    ),
    Lesson("{found} is no statement", FORM, "found", '( a ) | ) a | , a | "a" | [2]'),
    Lesson("'{first}' alone is no statement", FORM, "first", 'a | a "b" | a , b | a )'),
    Lesson(
        "missing label before '='",
        "name what the operation makes: label = operation ( ... );",
        "found",
        "= mate ( a )",
    ),
    Lesson(
        "{before} makes something without a name",
        "name what the operation makes: label = {first} ( ... );",
        "found",
        "mate ( a , b )",
    ),
    Lesson(
        "missing '=' after '{first}'",
        "write: {first} = operation ( ... );",
        "second",
        'a mate ( b ) | a mate = b | a mate b | a mate , b | a mate ) | a mate "b"',
    ),
    Lesson(
        "missing operation after '='",
        "name an operation: {first} = operation ( ... );",
        "behind",
        'a = | a = ( b ) | a = ) | a = , b | a = "b"',
    ),
    Lesson(
        "missing '=' after {before}",
        COPIES,
        "behind",
        'a [2] | a [2] b | a [2] ( b ) | a [2] , b | a [2] ) | a [2] "b" | a [2] [2]',
    ),
    Lesson(
        "unexpected {found}",
        "copies are defined by screw[2] = atomic ( ... ); screw[1] is one of them, screw both",
        "found",
        "a b [2] | a = [2] | a = b [2] | a = m ( [2] ) | a = m ( b , [2] ) | "
        'a = m ( b = [2] ) | a = m ( b = c [2] ) | a = m ( b = "c" [2] ) | a = m ( b = ( 1 ) [2] )',
    ),
    Lesson("one '=' is enough", FORM, "found", "a = = b ( ) | a = m ( b = = 1 )"),
    Lesson(
        "missing '(' after the operation {before}",
        "write the inputs in parentheses: {first} = operation ( input, ... );",
        "behind",
        'a = mate b , c ) | a = mate , b ) | a = mate ) | a = mate = b | a = mate "b" )',
    ),
    Lesson(
        "missing ')': the arguments of {operation} are not closed",
        "close them with ')' and end the statement with ';'",
        "behind",
        "a = m ( | a = m ( b | a = m ( b [2] | a = m ( b , c | a = m ( b , | a = m ( b = 1 | "
        'a = m ( b = "x" | a = m ( b = ( 1 ) | a = m ( b = 1 ,',
    ),
    Lesson(
        "missing ',' before {found}",
        ARGUMENTS,
        "behind",
        'a = m ( b c ) | a = m ( b [2] c ) | a = m ( b [2] "c" ) | a = m ( b [2] [2] ) | '
        'a = m ( b "c" ) | a = m ( b = 1 c ) | a = m ( b = 1 "c" ) | '
        'a = m ( b = "x" c ) | a = m ( b = ( 1 ) c ) | '
        'a = m ( b = "x" "y" ) | a = m ( b = ( 1 ) ( 2 ) ) | a = m ( b = "x" ( 2 ) ) | '
        'a = m ( b = ( 1 ) "x" )',
    ),
    Lesson(
        "missing argument before {found}",
        ARGUMENTS + "; none after the last",
        "found",
        "a = m ( , b ) | a = m ( b , ) | a = m ( b , , c ) | a = m ( b , c , ) | "
        "a = m ( b , c , , d )",
    ),
    Lesson(
        "missing keyword before '='",
        "a parameter reads: name = value",
        "found",
        "a = m ( = 1 ) | a = m ( b , = 1 )",
    ),
    Lesson(
        "unexpected '=' behind a value",
        ARGUMENTS,
        "found",
        "a = m ( b [2] = 1 ) | "
        'a = m ( b = c = 1 ) | a = m ( b = "x" = 1 ) | a = m ( b = ( 1 ) = 2 )',
    ),
    Lesson(
        "missing value after {before}",
        VALUE,
        "behind",
        "a = m ( b = ) | a = m ( b = , c ) | a = m ( b = | a = m ( b = ; c )",
    ),
    Lesson(
        "missing ',' before {found}",
        NUMBERS,
        "behind",
        "a = m ( b = ( 1 2 ) ) | a = m ( b = ( 1 , 2 3 ) ) | "
        'a = m ( b = ( 1 "x" ) ) | a = m ( b = ( 1 , 2 "x" ) ) | '
        "a = m ( b = ( 1 [2] ) ) | a = m ( b = ( 1 , 2 [2] ) )",
    ),
    Lesson(
        "missing number",
        NUMBERS,
        "found",
        "a = m ( b = ( ) ) | a = m ( b = ( , 1 ) ) | a = m ( b = ( 1 , ) ) | "
        "a = m ( b = ( 1 , , 2 ) )",
    ),
    Lesson(
        "missing ')': the list of numbers is not closed",
        NUMBERS,
        "behind",
        "a = m ( b = ( | a = m ( b = ( 1 | a = m ( b = ( 1 , | a = m ( b = ( 1 , 2",
    ),
    Lesson(
        "missing ')' before {before}: the list of numbers is not closed",
        NUMBERS,
        "last",
        "a = m ( b = ( c = 2 | a = m ( b = ( 1 , c = 2",
    ),
    Lesson(
        "{found} is not a number",
        NUMBERS,
        "found",
        'a = m ( b = ( "x" ) ) | a = m ( b = ( 1 , "x" ) ) | a = m ( b = ( ( 1 ) ) ) | '
        "a = m ( b = ( 1 , ( 2 ) ) ) | a = m ( b = ( = 1 ) ) | a = m ( b = ( 1 , = 1 ) ) | "
        "a = m ( b = ( [2] ) ) | a = m ( b = ( 1 , [2] ) )",
    ),
    Lesson(
        "an operation inside another",
        "give it a statement of its own, and use its label here: label = operation ( ... );",
        "found",
        "a = m ( b [2] ( c ) ) | "
        "a = m ( b ( c ) ) | a = m ( b = c ( d ) ) | a = m ( b = ( 1 ( 2 ) ) ) | "
        "a = m ( b = ( 1 , c ( 2 ) ) )",
    ),
    Lesson(
        "{found} needs the name of a parameter before it",
        'a value goes with a name: mesh = "base.stl", pos = ( 0, 0, 0.1 )',
        "found",
        'a = m ( "x" ) | a = m ( b , "x" ) | a = m ( ( 1 ) ) | a = m ( b , ( 1 ) )',
    ),
    Lesson(
        "';' inside the arguments of {operation}",
        ARGUMENTS,
        "found",
        "a = m ( b [2] ; c ) | "
        "a = m ( b ; c ) | a = m ( b = 1 ; c ) | a = m ( ; b ) | a = m ( b , ; c ) | "
        'a = m ( b = "x" ; c ) | a = m ( b = ( 1 ) ; c ) | a = m ( b = ( 1 ; 2 ) ) | '
        "a = m ( b = ( ; 2 ) ) | a = m ( b = ( 1 , ; 2 ) ) | "
        "a = m ( b = ( 1 , 2 ; 3 ) )",
    ),
    Lesson(
        "',' after a statement",
        "statements end with ';'",
        "found",
        "a = m ( b ) , c | a = m ( ) , c",
    ),
    Lesson(
        "')' without a '(' before it",
        "remove it, or open the parenthesis it closes",
        "found",
        "a = m ( b ) ) | a = m ( ) )",
    ),
    Lesson(
        "unexpected {found} after ')'",
        "a statement ends with ';' behind its last parenthesis",
        "found",
        'a = m ( b ) "c" | a = m ( b ) ( c ) | a = m ( b ) = c | a = m ( b ) [2] | '
        'a = m ( ) = b | a = m ( ) ( b ) | a = m ( ) "b" | a = m ( ) [2]',
    ),
    Lesson(
        "unexpected {before} after ')'",
        "a statement ends with ';' behind its last parenthesis; " + COPIES,
        "last",
        "a = m ( b ) c | a = m ( b ) c d | a = m ( b ) c = d | a = m ( b ) c , d | "
        'a = m ( b ) c ) | a = m ( b ) c "d" | a = m ( b ) c [2]',
    ),
    Lesson(
        "unexpected {found} after a place",
        "places lie between commas: at ( 0, 0, 0 ), ( 0, 0, 0.1 )",
        "found",
        "a = m ( ) at ( 1 ) ( 2 ) | a = m ( ) at ( 1 ) b | a = m ( ) at ( 1 ) = b | "
        'a = m ( ) at ( 1 ) ) | a = m ( ) at ( 1 ) "b" | a = m ( ) at ( 1 ) [2] | '
        "a = m ( ) at ( 1 ) , | a = m ( ) at ( 1 ) , b | a = m ( ) at ( 1 ) , = b | "
        'a = m ( ) at ( 1 ) , , ( 2 ) | a = m ( ) at ( 1 ) , ) | a = m ( ) at ( 1 ) , "b" | '
        "a = m ( ) at ( 1 ) , [2]",
    ),
)
