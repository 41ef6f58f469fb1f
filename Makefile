# factory: make demo, make test. Each sets up what it needs.
PY := .venv/bin/python
FACTORY := $(PY) -m factory

.PHONY: help demo test test-core test-all oracles bench fidelity faults compare docs gallery figures lint golden wheel setup clean

help:
	@echo "make setup     the tool and what its tests need, in .venv"
	@echo "make demo      run the paper's example: a video and a poster in renders/"
	@echo "make test      all tests, the long campaigns aside"
	@echo "make test-core those of them that need the core alone"
	@echo "make test-all  the long campaigns, too"
	@echo "make bench     times and sizes, written to docs/benchmarks.md"
	@echo "make fidelity  how far the physics can be believed, written to docs/fidelity.md"
	@echo "make faults    what becomes of factories in which things go wrong, written to docs/faults.md"
	@echo "make compare   beside what others publish, written to docs/comparison.md"
	@echo "make docs      the documentation site, in docs/_build/html"
	@echo "make gallery   render the stills of the gallery anew"
	@echo "make figures   draw the figures of the theory pages anew"
	@echo "make lint      ruff and mypy"
	@echo "make golden    renew the golden texts (review the diff)"
	@echo "make wheel     build the wheel in dist/"

setup:
	@tools/setup test

oracles:
	@tools/oracles

demo: setup
	$(FACTORY) check examples/paper.pag
	$(FACTORY) run examples/paper.pag --units 3 --video renders/paper.mp4
	$(FACTORY) render examples/paper.pag -o renders/paper.png --units 3 --at 4.9
	@echo "see renders/paper.mp4 and renders/paper.png"

test: setup
	TEST_DAY=$$(date +%y%m%d) $(PY) -m pytest -q -n 2 --dist worksteal -m "not slow" $(ARGS)

test-core: setup
	$(PY) -m pytest -q -n 2 --dist worksteal -m "not slow" tests/core $(ARGS)

test-all: setup oracles
	$(PY) -m pytest -q -n 2 --dist worksteal $(ARGS)

bench: setup
	$(PY) -m benches.speed $(ARGS)

fidelity: setup
	$(PY) -m benches.fidelity $(ARGS)

faults: setup
	$(PY) -m benches.faults $(ARGS)

compare: setup
	$(PY) -m benches.compare $(ARGS)

docs:
	@tools/setup docs
	$(PY) -m sphinx -W --keep-going -q -d docs/_build/trees docs docs/_build/html
	@echo "see docs/_build/html/index.html"

gallery: setup
	$(PY) tools/gallery $(ARGS)

figures: setup
	$(PY) -m tools.figures $(ARGS)

lint:
	@tools/setup dev
	$(PY) -m ruff check factory tests benches docs tools/gallery tools/figures
	$(PY) -m ruff format --check factory tests benches docs tools/gallery tools/figures
	$(PY) -m mypy

golden: setup
	$(PY) -m pytest -q -n 2 -m "not slow" --update-golden

wheel: setup
	$(PY) -m pip wheel --quiet --no-deps --wheel-dir dist .

clean:
	rm -rf .venv .oracles .engines .rivals build dist docs/_build *.egg-info .pytest_cache .mypy_cache .ruff_cache .hypothesis
