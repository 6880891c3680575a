# The set-up happens by itself, once, and again when what it reads changes.
bin := .venv/bin

.PHONY: run test flights attack mutation lint format docs gallery validation constraints clean

seed = 1

run: .venv/run.done
	$(bin)/mjspace run contraction-adaptive --plot --video

test: .venv/dev.done
	$(bin)/python -m pytest -n 2 --dist loadfile

# Every scenario from its beginning to its end, and the campaigns: about a quarter of an hour.
flights: .venv/dev.done
	$(bin)/python -m pytest -n 2 -m long

# Damaged and hostile scenarios, options, logs and kills, from one seed: hours.
attack: .venv/dev.done
	$(bin)/python tools/attack.py scenarios --cases 10000 --seed $(seed)
	$(bin)/python tools/attack.py options --cases 2000 --seed $(seed)
	$(bin)/python tools/attack.py logs --cases 10000 --seed $(seed)
	$(bin)/python tools/attack.py kills --cases 1000 --seed $(seed)

# Which changes of the modules that carry trust no test notices: of each, 40 at random; an hour.
mutation: .venv/dev.done
	nice $(bin)/python tools/mutation.py --sample 40

lint: .venv/dev.done
	$(bin)/ruff check
	$(bin)/ruff format --check
	$(bin)/mypy

format: .venv/dev.done
	$(bin)/ruff check --fix
	$(bin)/ruff format

# The documentation site, in build/site; any warning, such as a broken link, is an error.
docs: .venv/dev.done
	NO_MKDOCS_2_WARNING=1 $(bin)/mkdocs build -q --strict

# docs/gallery.md and its pictures, from the flights of every scenario, in build/gallery.
gallery: .venv/dev.done
	$(bin)/python tools/gallery.py

# What docs/validation.md says, measured again; Basilisk and its packages live apart from ours.
validation: .venv/dev.done build/basilisk.done
	$(bin)/mjspace validate --basilisk build/basilisk/bin/python --out build/validation
	$(bin)/python tools/validation_page.py build/validation/validation.json docs/validation.md

build/basilisk.done: .venv/dev.done
	$(bin)/uv venv -q --clear build/basilisk
	$(bin)/uv pip install -q --python build/basilisk bsk==2.12.1
	touch $@

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
