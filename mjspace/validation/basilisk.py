"""The comparisons with Basilisk, an engine that was written by others, from other equations."""

from mjspace.validation import basilisk_chain, basilisk_orbit
from mjspace.validation.basilisk_call import BasiliskMissingError
from mjspace.validation.results import Results


def compared(results: Results, python: str) -> Results:
    """Return ``results`` with the comparisons, or with a remark on why they were not made."""
    if not python:
        remark = "Basilisk: not compared; --basilisk PYTHON names an interpreter that has bsk"
        return results.model_copy(update={"remarks": [*results.remarks, remark]})
    try:
        sections = [basilisk_chain.compare(python), *basilisk_orbit.compare(python)]
    except BasiliskMissingError as error:
        remark = f"Basilisk: not compared; {error}"
        return results.model_copy(update={"remarks": [*results.remarks, remark]})
    return results.model_copy(update={"sections": [*results.sections, *sections]})
