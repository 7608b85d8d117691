"""validate_documents.py SCHEMAS DOCUMENTS: checks DOCUMENTS/NAME.NUMBER.json against SCHEMAS/NAME.json.

Members of an archive's metadata that are not listed are allowed, but none of ours: here they are faults as well.
Prints a line for each fault, and exits with 1 where there is one.
"""

import json
import pathlib
import sys

import jsonschema


def close(schema):
    """Allows no member that is not listed."""
    if isinstance(schema, dict):
        if "properties" in schema:
            schema.setdefault("additionalProperties", False)
        for part in schema.values():
            close(part)


schemas = {path.stem: json.loads(path.read_text()) for path in pathlib.Path(sys.argv[1]).glob("*.json")}
close(schemas["metadata"])
store = {schema["$id"]: schema for schema in schemas.values()}
faults = 0
for path in sorted(pathlib.Path(sys.argv[2]).glob("*.json")):
    schema = schemas[path.name.split(".")[0]]
    jsonschema.Draft202012Validator.check_schema(schema)
    resolver = jsonschema.RefResolver(schema["$id"], schema, store=store)
    document = json.loads(path.read_text())
    found = list(jsonschema.Draft202012Validator(schema, resolver=resolver).iter_errors(document))
    # Of alternatives, what the one that comes nearest finds.
    for error in found:
        while error.context:
            of_each = {}
            for inner in error.context:
                of_each.setdefault(inner.schema_path[0], []).append(inner)
            error = min(of_each.values(), key=len)[0]
        faults += 1
        print(f"{path.name}: {'/'.join(map(str, error.absolute_path))}: {error.message[:300]}")
sys.exit(1 if faults else 0)
