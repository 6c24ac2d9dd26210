"""What several formats are written in (JSON, XML, arrays of NumPy, packed files), under limits."""
