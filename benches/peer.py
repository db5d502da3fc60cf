"""Runs the peers of the reference problems on request.

Started in a prepared copy of their scripts. Reads lines such as `P1 nominal 3e-8` (problem, what, relative tolerance) and answers
each with the seconds of one run; what is compiled for a first run is kept for the next.
"""

import sys
import time

MATRICES = {"P1": "nalgebra_dense", "P2": "faer_sparse"}
made = {}


def solver(problem, what, tolerance):
    """A function that runs once."""
    if what == "bdf":
        import run_casadi

        definition, integrator, _ = run_casadi.build(problem, "cvodes", 1, tolerance)
        return lambda: run_casadi.run_nom(definition, integrator)
    import run_diffsol

    model, _ = run_diffsol.build(problem, MATRICES[problem], "tsit45", tolerance)
    if what == "nominal":
        return lambda: run_diffsol.nom(problem, model)
    return lambda: run_diffsol.sens(problem, model, True)


for line in sys.stdin:
    if line not in made:
        problem, what, tolerance = line.split()
        made[line] = solver(problem, what, float(tolerance))
        made[line]()
    begin = time.perf_counter()
    made[line]()
    print(time.perf_counter() - begin, flush=True)
