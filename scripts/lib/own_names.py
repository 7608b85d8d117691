#!/usr/bin/env python3
"""Prints names that two sources have for themselves which a build without ccache compiles together: those of a folder of
the product (isohf_compile), those of a test program (isohf_test) unless isohf_test_alone lists them."""

import re
from pathlib import Path

UNNAMED = re.compile(r"^namespace \{\n(.*?)^\}  // namespace\n", re.M | re.S)
TYPE = re.compile(r"(?:struct|class|enum class|enum) (\w+)\b[^;]*$")
ALIAS = re.compile(r"using (\w+) = ")
FUNCTION = re.compile(r"^[\w:<>,&*\[\] ]*[ &*](\w+)\((.*?)\)[^()]* \{$", re.S)
VARIABLE = re.compile(r"^(?:static |constexpr |const |thread_local |inline )+[\w:<>,&* ]*?(\w+)(?: =|\{|;|\[| = \{)")


def kind(type_name):
    """Types that become each other in a call are one: a call would take another source's function without a word."""
    if re.search(r"\bstring\b|\bstring_view\b|\bchar ?\*", type_name):
        return "text"
    if re.fullmatch(r"(?:const )?(?:std::)?(?:u?int\d+_t|s?size_t|int|unsigned|long|double|float|bool|char)", type_name):
        return "number"
    return type_name


def own_names(path):
    """Name, or name and parameters of a function, of what stands in unnamed namespaces, at the start of a line."""
    for body in UNNAMED.findall(re.sub(r'R"(\w*)\(.*?\)\1"', "", path.read_text(), flags=re.S)):
        # A declaration begins in the first column and goes on in those that are indented.
        for part in re.split(r"\n(?=[A-Za-z\[])", "\n" + body):
            head = re.sub(r"//.*", "", part.strip("\n").split("\n}")[0])
            line = re.match(r"[^\n]*(?:\n {4,}[^\n]*)*", head).group(0)
            line = re.sub(r"^(?:\[\[\w+\]\] |template <[^\n]*>\n?)+", "", line)
            if found := TYPE.match(line):
                yield found.group(1)
            elif found := FUNCTION.match(line):
                types = [re.sub(r"\s*\w+(?: = .*)?$", "", each.strip()) for each in found.group(2).split(",")]
                yield f"{found.group(1)}({', '.join(map(kind, types))})"
            elif found := VARIABLE.match(line):
                yield found.group(1)


def together():
    """Sources that are compiled together, of each folder and of each test program."""
    with_options = re.compile(r"set_source_files_properties\(([^)]*?)PROPERTIES\s+COMPILE_")
    for top in ("libisohf", "formats", "apps"):
        lists = Path(top, "CMakeLists.txt")
        alone = {Path(top, each) for sources in with_options.findall(lists.read_text()) for each in sources.split()}
        folders = {}
        for path in sorted(set(Path(top).rglob("*.cpp")) - alone):
            folders.setdefault(path.parent, []).append(path)
        yield from folders.items()
    for lists in sorted(Path("tests").rglob("CMakeLists.txt")):
        text = re.sub(r"#.*", "", lists.read_text()).replace("${PROJECT_SOURCE_DIR}", str(Path.cwd()))
        calls = {name: [] for name in ("isohf_test_alone", "isohf_test")}
        for name, arguments in re.findall(r"\b(isohf_test_alone|isohf_test)\(([^)]*)\)", text):
            calls[name].append(arguments.split("LIBS")[0].split())
        alone = {source for sources in calls["isohf_test_alone"] for source in sources}
        for program, *sources in calls["isohf_test"]:
            yield program, [lists.parent / source for source in sources if source not in alone]


for where, sources in together():
    seen = {}
    for source in sources:
        for name in set(own_names(source)):
            if name in seen:
                print(f"{source}: {name} is a name of {seen[name]} as well, which {where} compiles together with it")
            seen[name] = source
