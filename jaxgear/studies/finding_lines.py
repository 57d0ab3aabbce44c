"""What is out of the usual range, in lines."""

from collections.abc import Iterator, Mapping

from ..metrics import Finding

WARNING = "warning: "


def finding_lines(found: Mapping[str, tuple[Finding, ...]]) -> Iterator[str]:
    """A line for everything that is not usual, with the designs that have it and their numbers where they differ."""
    grouped: dict[tuple[str, str], dict[str, Finding]] = {}
    for design, several in found.items():
        for finding in several:
            grouped.setdefault((finding.name, finding.where), {})[design] = finding
    for same in grouped.values():
        finding = list(same.values())[-1]  # the last is the one that the run is about
        numbers = {design: f"{each.value:.4g} {each.limit.unit}".rstrip() for design, each in same.items()}
        if len(set(numbers.values())) > 1:
            said = f"{', '.join(f'{design} {number}' for design, number in numbers.items())}: "
        else:
            said = "" if len(same) == len(found) else f"{', '.join(same)}: "
        yield f"{WARNING}{said}{finding}"
