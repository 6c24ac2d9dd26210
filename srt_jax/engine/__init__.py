"""How a public call reaches its kernel: arguments, size buckets, cores, devices, batches of maps,
packed masks.
"""
