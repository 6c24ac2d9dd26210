"""Derivatives of least costs: exact ones by the envelope theorem, smooth ones by perturbation.

Where the cells of a map cost differently, the costs themselves are computed here, too:
`cell_costs`. Where all cost the same they are lengths: `srt_jax/propagation/lengths.py`.
"""
