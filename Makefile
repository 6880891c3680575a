# The set-up happens by itself, once, and again when what it reads changes.
bin := .venv/bin

.PHONY: run test lint format constraints clean

run: .venv/run.done
	$(bin)/mjspace run contraction-adaptive --plot --video

test: .venv/dev.done
	$(bin)/python -m pytest

lint: .venv/dev.done
	$(bin)/ruff check
	$(bin)/ruff format --check
	$(bin)/mypy

format: .venv/dev.done
	$(bin)/ruff check --fix
	$(bin)/ruff format

# Who can develop can also fly.
.venv/%.done: pyproject.toml constraints.txt tools/setup
	tools/setup $*
	touch .venv/run.done $@

# One set of versions for every Python, so that a flight is the same everywhere.
constraints: .venv/dev.done
	$(bin)/uv pip compile -q --upgrade --universal --fork-strategy fewest --python-version 3.11 \
	  --all-extras --no-annotate --no-emit-index-url --no-emit-find-links \
	  --custom-compile-command "make constraints" -o constraints.txt pyproject.toml

clean:
	rm -rf .venv build dist *.egg-info .pytest_cache .mypy_cache .ruff_cache .hypothesis
	find . -name __pycache__ -prune -exec rm -rf {} +
