# SPDX-License-Identifier: BSD-3-Clause
"""Lays out the figures of `bench` as text."""


def _number(value, form):
    return "-" if value is None else form.format(value)


def _tracker(results):
    for result in results:
        yield (
            f"{result['tracker']}, {result['resolution']}, target {result['target_px']} px",
            f"{result['cpu_ms']:.1f} ms",
        )


def _stereo(results):
    for name, result in results.items():
        yield f"{name}, stereo_cloud", _number(result["ours_cpu_ms"], "{:.1f} ms")
        yield f"{name}, stereo_image_proc", _number(result["peer_cpu_ms"], "{:.1f} ms")
        yield f"{name}, ratio", _number(result["ratio"], "{:.2f}")


def _simulator(result):
    for resolution, cpu_ms in result["pair_cpu_ms"].items():
        yield f"stereo pair {resolution}", f"{cpu_ms:.1f} ms"
    yield "physics, one step", f"{result['step_us']:.1f} us"


def _graph(result):
    yield f"{result['resolution']} at {result['rate_hz']:g} Hz", f"{result['frames']} frames"
    yield "real-time factor", f"{result['real_time_factor']:.3f}"
    yield "skipped frames", f"{result['skipped_frames']}"
    for name, value in result["latency_ms"].items():
        yield f"stamp to /cmd_vel, {name}", _number(value, "{:.1f} ms")
    for node, cpu_ms in result["cpu_ms_per_frame"].items():
        yield node, f"{cpu_ms:.1f} ms"


def _lockstep(result):
    yield f"{result['scenario']}, {result['resolution']}", f"{result['real_time_factor']:.2f}x real time"


_PARTS = {
    "tracker": ("tracker: CPU time of update()", _tracker),
    "stereo": ("stereo nodes: CPU time of a pair, 640x480", _stereo),
    "simulator": ("simulator: CPU time", _simulator),
    "graph": ("whole graph in real time: CPU time of a frame by node", _graph),
    "lockstep": ("whole graph in lockstep", _lockstep),
}


def text(results):
    """Return the table of results, name of the part -> its object in the JSON, None where it failed."""
    lines = []
    for part, result in results.items():
        title, rows_of = _PARTS[part]
        lines.append(title)
        rows = [("not measured", "")] if result is None else list(rows_of(result))
        width = max(len(name) for name, _ in rows)
        lines += [f"  {name.ljust(width)}  {value.rjust(14)}".rstrip() for name, value in rows]
    return "\n".join(lines)
