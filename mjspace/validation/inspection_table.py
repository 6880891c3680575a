"""What was recognized in a model, as tables on the terminal."""

from functools import partial

from rich.console import Console
from rich.markup import escape

from mjspace.validation.inspection import Inspection, Whole
from mjspace.validation.table import console_of_terminal, table_of


def show(found: Inspection) -> None:
    """Print the model's parts, what they are taken for, and what keeps it from flying."""
    console = console_of_terminal()
    say = partial(console.print, highlight=False, soft_wrap=True)
    say(f"{found.model}: {'flies' if found.flies else 'cannot fly'}", markup=False)
    for finding in found.findings:
        word = "[bold red]refused[/]" if finding.refused else "[yellow]note[/]"
        say(f"{word}: {escape(finding.text)}")
    bodies = table_of("body", "on", "joints", "mass [kg]", "principal moments [kg m^2]")
    for body in found.bodies:
        moments = _numbers(body.principal_moments)
        names = (escape(body.name), escape(body.parent), escape(", ".join(body.joints)))
        bodies.add_row(*names, f"{body.mass:.6g}", moments)
    console.print(bodies)
    if found.vehicle is not None:
        _show_vehicle(console, found.vehicle)
    sensors = [
        f"{s.name} ({s.kind})" + (f" as {s.measured_as}" if s.measured_as != s.name else "")
        for s in found.sensors
    ]
    say(f"sensors: {', '.join(sensors) or 'none'}", markup=False)
    say(f"cameras: {', '.join(found.cameras) or 'none; one is added'}", markup=False)


def _show_vehicle(console: Console, vehicle: Whole) -> None:
    say = partial(console.print, highlight=False, soft_wrap=True, markup=False)
    centre = _numbers(vehicle.center_of_mass)
    say(f"vehicle: bus {vehicle.bus!r}, {vehicle.mass:.6g} kg, centre of mass {centre} m")
    if vehicle.beside:
        say(f"other spacecraft: {', '.join(vehicle.beside)}")
    if vehicle.wheels:
        wheels = table_of("reaction wheel", "hinge", "axis", "inertia [kg m^2]", "torque [N m]")
        for wheel in vehicle.wheels:
            wheels.add_row(
                escape(wheel.motor),
                escape(wheel.hinge),
                _numbers(wheel.axis),
                f"{wheel.inertia:.6g}",
                _limit(wheel.torque_limit),
            )
        console.print(wheels)
    if vehicle.thrusters:
        thrusters = table_of("thruster", "site", "position [m]", "direction", "force [N]")
        for each in vehicle.thrusters:
            names = escape(each.motor), escape(each.site)
            place, way = _numbers(each.position), _numbers(each.direction)
            thrusters.add_row(*names, place, way, _limit(each.force_limit))
        console.print(thrusters)
    if vehicle.others:
        others = table_of("other motor", "acts on", "from", "to")
        for motor in vehicle.others:
            others.add_row(escape(motor.motor), escape(motor.drives), *map(_limit, motor.range))
        console.print(others)
    if vehicle.gimbals:
        say(f"measured hinges: {', '.join(vehicle.gimbals)}")
    fields = ", ".join(
        f"{name} ({field.size}){f' [{field.unit}]' if field.unit else ''}"
        for name, field in vehicle.command.items()
    )
    say(f"a law commands: {fields or 'nothing'}")


def _numbers(values: list[float]) -> str:
    return " ".join(f"{value + 0.0:.5g}" for value in values)


def _limit(value: float | None) -> str:
    return "none" if value is None else f"{value:.6g}"
