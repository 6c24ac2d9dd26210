"""What both packages stand on, `srt_jax` and `sign_model`: how a program is compiled, and how many
cores it may use.

It imports nothing of ours but itself, and may be imported from anywhere.
"""
