"""Every public function on an accelerator, held against the CPU bit for bit and timed beside it."""
