# make demo: plan the paper's feeding motion and replay it on the virtual board
# make test: bring the interpreters, run all tests
# make check: lint and types
# Each sets up its own environment in .venv; nothing outside the checkout is touched.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin

.PHONY: demo test check bench clean

demo: $(VENV)/demo
	"$(BIN)/armtempo" demo

test: $(VENV)/test
	"$(BIN)/python" tests/get_micropython.py
	"$(BIN)/python" -m pytest $(PYTEST_ARGS)

check: $(VENV)/test
	"$(BIN)/ruff" check .
	"$(BIN)/ruff" format --check .
	"$(BIN)/mypy" --strict host/armtempo shared/armtempo_shared

$(BIN)/python:
	$(PYTHON) -c 'import sys; sys.exit("armtempo needs Python 3.11 or newer, this is " + sys.version.split()[0] + "; set PYTHON=") if sys.version_info < (3, 11) else None'
	$(PYTHON) -m venv $(VENV)

$(VENV)/demo: pyproject.toml | $(BIN)/python
	"$(BIN)/python" -m pip install --quiet --disable-pip-version-check -e '.[plot]'
	@touch $@

$(VENV)/test: pyproject.toml | $(BIN)/python
	"$(BIN)/python" -m pip install --quiet --disable-pip-version-check -e '.[plot,cluster,mpy]' -r tests/requirements.txt
	@touch $@ $(VENV)/demo

clean:
	rm -rf $(VENV) .cache build dist
