"""Runs the peers of the reference problems on request.

Started in a prepared copy of their scripts. Reads lines such as `P1 nominal 3e-8` (problem, what, relative tolerance) and answers
each with the seconds of one run; what is compiled for a first run is kept for the next. `rates` are those of 1000 calls.
"""

import ctypes
import io
import contextlib
import subprocess
import sys
import time

MATRICES = {"P1": "nalgebra_dense", "P2": "faer_sparse"}
CALLS = """
int f(const double** arguments, double** results, long long* integers, double* memory, int);
static double memory[100000];
static long long integers[1000];
void calls(double* x, const double* p, double* rates) {
  for (int k = 0; k < 1000; k++) {
    double t = 1.0 + 1e-4 * k;
    const double* arguments[8] = {&t, x, p};
    double* results[4] = {rates};
    f(arguments, results, integers, memory, 0);
    x[0] = 0.001 + 1e-12 * rates[0];
  }
}
"""
made = {}


def calls(problem):
    """A function that calls the generated right-hand side, compiled by gcc, 1000 times."""
    import common
    import numpy

    library = f"./calls_{problem}.so"
    flags = ["-O3", "-march=native", "-shared", "-fPIC", "-x", "c", "-", "-x", "none", f"./{problem}_gen.so"]
    subprocess.run(["gcc", *flags, "-Wl,-rpath,$ORIGIN", "-o", library], input=CALLS, text=True, check=True)
    function = ctypes.CDLL(library).calls
    parameters = numpy.ascontiguousarray(common.PP[problem]["p0"], dtype=float)
    x, rates = numpy.full(common.PP[problem]["nx"], 0.001), numpy.zeros(200)
    pointer = lambda array: ctypes.c_void_p(array.ctypes.data)
    return lambda: function(pointer(x), pointer(parameters), pointer(rates))


def identification(tolerance):
    """A function that identifies the parameters of P1."""
    import run_lsq

    def run():
        with contextlib.redirect_stdout(io.StringIO()):
            run_lsq.peer(f"diffsol:tsit45:{tolerance}:1")

    return run


def solver(problem, what, tolerance):
    """A function that runs once."""
    if what == "rates":
        return calls(problem)
    if what == "identification":
        return identification(tolerance)
    if what == "bdf":
        import run_casadi

        definition, integrator, _ = run_casadi.build(problem, "cvodes", 1, float(tolerance))
        return lambda: run_casadi.run_nom(definition, integrator)
    import run_diffsol

    model, _ = run_diffsol.build(problem, MATRICES[problem], "tsit45", float(tolerance))
    if what == "nominal":
        return lambda: run_diffsol.nom(problem, model)
    return lambda: run_diffsol.sens(problem, model, True)


for line in sys.stdin:
    if line not in made:
        made[line] = solver(*line.split())
        made[line]()
    begin = time.perf_counter()
    made[line]()
    print(time.perf_counter() - begin, flush=True)
