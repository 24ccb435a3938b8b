"""Speed against error: every method on the same states, in one run, against 50-digit references.

cases          the states, what is asked of them, and the stored references
exact          this package's closed forms, and its elements with a given number of terms
chain          its chain of links in both settings
collocation    a peer: SciPy's solve_bvp
dense          a peer: the published procedure, Newton's method and eigenvalues with full matrices
interior_point a peer: IPOPT through casadi
measure        the run: interleaved rounds, one dataset
floor          what each quantity costs, beside a perfect solver's special functions and dense algebra
report         tables, ratios at equal error; figures: error against time
folder         what a run leaves behind
scale          whole studies of growing size; storage: the same dataset in several layouts; scale_report
"""
