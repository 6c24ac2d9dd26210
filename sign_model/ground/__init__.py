"""What both packages stand on, `srt_jax` and `sign_model`: how a program is compiled, how many
cores it may use, records of arrays, sets as words of bits, and sizes to pad to.

It imports nothing of ours but itself, and may be imported from anywhere.
"""
