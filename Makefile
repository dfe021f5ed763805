# make demo: plan the paper's feeding motion and replay it on the virtual board
# make test: bring the interpreters, run all tests
# make long: the tests that take long, which the others leave out
# make quick: those that take about a minute together, for the inner loop of work
# make check: lint and types
# make docs: the documentation site, in build/site
# Each sets up its own environment in .venv; nothing outside the checkout is touched.

PYTHON ?= python3
# Tests are compiled once, whatever the shell says: it takes half of the time to collect them.
export PYTHONDONTWRITEBYTECODE =
VENV := .venv
BIN := $(VENV)/bin
# tests/conftest.py says how many that are.
WORKERS ?= auto

.PHONY: demo test long quick check docs clean

demo: $(VENV)/demo
	"$(BIN)/armtempo" demo

test: $(VENV)/test
	"$(BIN)/python" .ci/get_micropython.py
	"$(BIN)/python" -m pytest -n $(WORKERS) --dist loadgroup $(PYTEST_ARGS)

long: PYTEST_ARGS = --long -m long
long: test

quick: $(VENV)/test
	"$(BIN)/python" -m pytest -q -n $(WORKERS) --dist loadgroup -m "not slow" --ignore=tests/system $(PYTEST_ARGS)

check: $(VENV)/test .cache/typings
	"$(BIN)/ruff" check .
	"$(BIN)/ruff" format --check .
	"$(BIN)/mypy" --strict host/armtempo shared/armtempo_shared
	"$(BIN)/mypy" --config-file board/mypy.ini board/armtempo_board

$(BIN)/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "armtempo needs Python 3.11 or newer: make PYTHON=python3.11")'
	$(PYTHON) -m venv $(VENV) || { rm -rf $(VENV); test "$$(id -u)" = 0 && apt-get install -qy python3-venv && $(PYTHON) -m venv $(VENV); }

$(VENV)/demo: pyproject.toml | $(BIN)/python
	"$(BIN)/python" -m pip install --quiet --disable-pip-version-check -e '.[plot,panel]'
	@touch $@

$(VENV)/test: pyproject.toml | $(BIN)/python
	"$(BIN)/python" -m pip install --quiet --disable-pip-version-check uv # which takes a tenth of pip's time for what follows
	"$(BIN)/uv" pip install --quiet --python "$(BIN)/python" -e '.[plot,cluster,mpy,urdf,ros,panel,docs]' -r tests/requirements.txt
	@touch $@ $(VENV)/demo

.cache/typings: board/mypy.ini | $(VENV)/test
	"$(BIN)/uv" pip install --quiet --python "$(BIN)/python" --upgrade --target $@ micropython-stm32-stubs
	# A viper function takes any buffer or address for a pointer, which the stubs cannot say.
	sed -i.old 's/def viper(_func: Callable\[_Param, _Ret\], \/) -> Callable\[_Param, _Ret\]/def viper(_func: Callable[_Param, _Ret], \/) -> Callable[..., _Ret]/' $@/micropython.pyi
	grep -q 'Callable\[..., _Ret\]' $@/micropython.pyi
	@touch $@

docs: $(VENV)/test
	"$(BIN)/python" -m sphinx -q -W --keep-going -c host/docs/site . build/site
	@echo "build/site/index.html"

clean:
	rm -rf $(VENV) .cache build dist
