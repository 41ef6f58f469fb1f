"""Parses Structured Text by a grammar of the standard for tree-sitter: the kind of each thing
declared."""

import json
import sys
from pathlib import Path


def main() -> None:
    import tree_sitter
    import tree_sitter_iec61131_3_st

    parser = tree_sitter.Parser(tree_sitter.Language(tree_sitter_iec61131_3_st.language()))
    root = parser.parse(Path(sys.argv[1]).read_bytes()).root_node
    if root.has_error:
        raise SyntaxError(str(root))
    print(json.dumps([child.type for child in root.children if child.type != "comment"]))


if __name__ == "__main__":
    main()
