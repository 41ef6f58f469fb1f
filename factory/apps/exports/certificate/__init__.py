"""Certificates of nets as JSON: `writer.py` writes one, `proof_file.py` reads it, and `check.py`
checks it, by programs that share no code with the compiler."""
