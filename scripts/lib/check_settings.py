#!/usr/bin/env python3
"""check_settings.py: holds the library's messages against the options that set what they name.

The library knows no option: no string literal of libisohf/ or formats/ holds one ("--name"), unless its line says
NOLINT. A message names a setting by an identifier between backticks: an option has its name, with dashes, or that of the
table of spellings in apps/common/output/standard_output.cpp. Prints findings, one a line.
"""
import re
import sys
from pathlib import Path

TABLE = Path('apps/common/output/standard_output.cpp')
LITERAL = re.compile(r'"((?:[^"\\\n]|\\.)*)"')


def main():
    spellings = dict(re.findall(r'\{"([a-z_]+)", "(--[a-z-]+)"\},', TABLE.read_text(encoding='utf-8')))
    declared = set()
    for path in Path('apps').rglob('*.cpp'):
        if path != TABLE:
            declared.update(re.findall(r'"(?:-[a-zA-Z],)?(--[a-z-]+)"', path.read_text(encoding='utf-8')))
    named = set()
    for folder in ('libisohf', 'formats'):
        for path in sorted(Path(folder).rglob('*.[ch]*')):
            for number, line in enumerate(path.read_text(encoding='utf-8').splitlines(), 1):
                if line.lstrip().startswith('//') or 'NOLINT' in line:
                    continue
                for text in LITERAL.findall(line):
                    if re.search(r'--[a-z]', text):
                        print(f'{path}:{number}: "{text}" spells an option; name the setting between backticks')
                    for name in re.findall(r'`([a-z_]+)`', text):
                        named.add(name)
                        if spellings.get(name, '--' + name.replace('_', '-')) not in declared:
                            print(f'{path}:{number}: no command has an option for `{name}`')
    for name in spellings:
        if name not in named:
            print(f'{TABLE}: no message names `{name}`')


if __name__ == '__main__':
    sys.exit(main())
