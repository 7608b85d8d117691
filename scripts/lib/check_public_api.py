#!/usr/bin/env python3
"""check_public_api.py [--list]: holds docs/library.md against the public headers and the examples.

Every public function of libisohf/include/isohf/ has its place in the page's table "What tests which function", every
test file, fuzzer and function of the table exists, every quotation of an example is the file as it is, and isohf.h
includes every header. Prints findings, one a line; --list prints the functions, header by header.
"""
import re
import sys
from pathlib import Path

HEADERS = Path('libisohf/include/isohf')
PAGE = Path('docs/library.md')


def statements(text):
    """(scopes, access, statement) of everything declared outside of function bodies."""
    text = re.sub(r'//[^\n]*|^\s*#[^\n]*', '', text, flags=re.M)
    stack = [('namespace', '', 'public')]
    start = at = 0
    while at < len(text):
        c = text[at]
        head = text[start:at].strip()
        if c == '{':
            named = re.search(r'\b(namespace|class|struct|enum)\b(?: class)?\s*(\w*)[^;()]*$', head)
            if named and not head.endswith('='):
                kind, name = named.groups()
                stack.append((kind, name, 'private' if kind == 'class' else 'public'))
                start = at + 1
            else:  # a body or an initialiser: over it
                depth = 0
                while True:
                    depth += {'{': 1, '}': -1}.get(text[at], 0)
                    if depth == 0:
                        break
                    at += 1
                yield stack, head
                start = at + 1
        elif c == '}':
            stack.pop()
            start = at + 1
        elif c == ';':
            yield stack, head
            start = at + 1
        elif c == ':' and head.split()[-1:] in (['public'], ['private'], ['protected']):
            stack[-1] = (stack[-1][0], stack[-1][1], head.split()[-1])
            start = at + 1
        at += 1


def functions(path):
    found = []
    for stack, statement in statements(path.read_text(encoding='utf-8')):
        if any(kind == 'enum' or access != 'public' for kind, _, access in stack):
            continue
        if re.search(r'=\s*(delete|default)$|\bfriend\b|\busing\b|^struct|^class|~', statement):
            continue
        bare = re.sub(r'\[\[.*?\]\]', '', statement)
        name = re.match(r'[^=(]*?\b(\w+)\s*\(', re.sub(r'std::function<[^;]*>\s', '', bare))
        if not name:
            continue
        types = [n for kind, n, _ in stack if kind in ('class', 'struct')]
        found.append('::'.join(types + [name[1]]))
    return sorted(set(found))


def main():
    headers = sorted(HEADERS.glob('*.h'))
    if sys.argv[1:] == ['--list']:
        for path in headers:
            print(path.name, ' '.join(functions(path)))
        return
    whole = (HEADERS / 'isohf.h').read_text(encoding='utf-8')
    for path in headers:
        if path.name != 'isohf.h' and f'"isohf/{path.name}"' not in whole:
            print(f'{HEADERS}/isohf.h: does not include isohf/{path.name}')
    page = PAGE.read_text(encoding='utf-8')
    for name, quoted in re.findall(r'<!-- (examples/\w+\.cpp) -->\n```cpp\n(.*?)```', page, flags=re.S):
        if Path(name).read_text(encoding='utf-8') != quoted:
            print(f'{PAGE}: {name} is quoted otherwise than it is')
    for path in sorted(Path('examples').glob('*.cpp')):
        if f'<!-- {path} -->' not in page:
            print(f'{PAGE}: {path} is not quoted')
        if len(path.read_text(encoding='utf-8').splitlines()) >= 60:
            print(f'{path}: has 60 lines or more')
    table = page[page.index('## What tests which function'):]
    listed = set()
    for header, names, tests in re.findall(r'^\| (\w+\.h) \| (.*?) \| (.*?) \|$', table, flags=re.M):
        here = set(functions(HEADERS / header)) if (HEADERS / header).exists() else set()
        for name in re.findall(r'`([\w:]+)`', names):
            listed.add((header, name))
            if name not in here:
                print(f'{PAGE}: {header} has no public function {name}')
        for test in re.findall(r'tests/[\w/]+\.cpp', tests):
            if not Path(test).exists():
                print(f'{PAGE}: {test} does not exist')
        if not re.search(r'tests/|trivial', tests):
            print(f'{PAGE}: {header}: {names} has neither a test nor is it trivial')
    for path in headers:
        for name in functions(path):
            if (path.name, name) not in listed:
                print(f'{PAGE}: {path.name}: what tests {name}?')


if __name__ == '__main__':
    sys.exit(main())
