"""Derivatives of least costs: exact ones by the envelope theorem, smooth ones by perturbation."""
