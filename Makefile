# Entry points of the repository. What takes more than a command or two lives in scripts/.

PREFIX  ?= /usr/local
DESTDIR ?=
BUILD   ?= build
CARGO   ?= cargo
OBJCOPY ?= objcopy
# Maps and meshes that are not part of the project; where they are absent, a sky and a knot are made.
DATA    ?= ../shared/data
# Empty: the renderer's part alone, wis.h.
FEATURES ?= lights wavelets
# Instructions above those of every processor of the target, which a sampler detects. Empty: none.
LEVELS ?= avx2
# Empty: wis_direct alone, without wis_product_*, wis_sample, wis_pdf and wis_invert.
PRODUCTS ?= products
# Empty: without wis_check and wis_check_point, which a renderer calls while it is written.
CHECKS ?= checks

# Of archives: targets of rustc.
PLATFORMS ?= native aarch64-unknown-linux-gnu x86_64-pc-windows-gnu aarch64-apple-darwin

TARGET  := $(or $(CARGO_TARGET_DIR),target)
VERSION := $(shell sed -n 's/^version = "\(.*\)"/\1/p' Cargo.toml | head -n 1)
MAJOR   := $(word 1,$(subst ., ,$(VERSION)))
MINOR   := $(word 2,$(subst ., ,$(VERSION)))
# What may break the binary interface: a minor version before 1.0, a major version from then on. capi/build.rs says the same.
ABI     := $(if $(filter 0,$(MAJOR)),$(MAJOR).$(MINOR),$(MAJOR))
ROOT    := $(DESTDIR)$(PREFIX)

LIB      := $(BUILD)/lib
# What the front ends of the renderer share; its OpenEXR part is C++.
RENDER   := $(wildcard c-examples/render/*.c) $(BUILD)/exr.o
TRACER   := $(addprefix c-examples/render/,environment.c hdr.c image.c light.c material.c options.c parallel.c read.c sky.c stb.c) $(BUILD)/exr.o
EXR_LIBS  = $(shell pkg-config --libs OpenEXR) -lstdc++
CFLAGS   ?= -O2 -Wall -Wextra -Wpedantic
CXXFLAGS ?= $(CFLAGS)

FILL_IN := sed -e 's/@VERSION@/$(VERSION)/' -e 's/@MAJOR@/$(MAJOR)/' -e 's/@MINOR@/$(MINOR)/' \
	-e 's/@ABI@/$(ABI)/'

.PHONY: help lib header install install-files print-abi demo pathtracer pathtracer-page figure gallery hardcases report goals performance check-pages light rooms structured wavelets \
	triple check test fuzz fuzz-guided growth instructions check-bits coverage soak sanitizers mutants check-aarch64 check-thumb renderers cycles test-renderers web test-web test-slow dist wheel docs abi clean

help: ## list the targets
	@sed -n 's/^\([a-z0-9-]*\):.*## /\1\t/p' Makefile | expand -t 17

lib: ## build the static and the shared library into build/lib: FEATURES= for the renderer's part alone, LEVELS= without AVX2, PRODUCTS= without products, CHECKS= without checks
	RUSTFLAGS="$$RUSTFLAGS $$(tr '\n' ' ' < capi/flags)" $(CARGO) build --release --package wis-capi --lib --no-default-features \
		--features '$(FEATURES) $(PRODUCTS) $(CHECKS) $(LEVELS)'
	OBJCOPY='$(OBJCOPY)' scripts/library.sh $(TARGET)/release $(LIB) $(VERSION) $(ABI)

print-abi:
	@echo $(ABI)

header: ## write the C headers in include/ from the Rust sources
	$(CARGO) run --quiet --package xtask -- header

install: lib ## install libraries, headers, licences, pkg-config file and CMake package: PREFIX=/usr/local DESTDIR=
	$(MAKE) --no-print-directory install-files

install-files:
	install -d $(ROOT)/include $(ROOT)/lib/pkgconfig $(ROOT)/lib/cmake/wis $(ROOT)/share/licenses/wis
	install -m 644 include/wis.h include/wis.hpp $(addprefix include/wis_,$(addsuffix .h,$(FEATURES))) $(ROOT)/include
	$(if $(and $(filter lights,$(FEATURES)),$(filter wavelets,$(FEATURES))),install -m 644 include/wis_wavelets.hpp $(ROOT)/include)
	cp -P $(LIB)/*wis.* $(ROOT)/lib
	install -m 644 LICENSE-MIT LICENSE-APACHE $(ROOT)/share/licenses/wis
	cp -R packaging/licences/* $(ROOT)/share/licenses/wis
	$(FILL_IN) packaging/wis.pc.in > $(ROOT)/lib/pkgconfig/wis.pc
	$(FILL_IN) packaging/wisConfig.cmake.in > $(ROOT)/lib/cmake/wis/wisConfig.cmake
	$(FILL_IN) packaging/wisConfigVersion.cmake.in > $(ROOT)/lib/cmake/wis/wisConfigVersion.cmake

$(BUILD)/minimal: lib
	$(CC) -std=c99 $(CFLAGS) -g -Iinclude c-examples/minimal.c $(LIB)/libwis.a -o $@

$(BUILD)/first: lib
	$(CC) -std=c99 $(CFLAGS) -g -Iinclude c-examples/first.c $(LIB)/libwis.a -lm -o $@

$(BUILD)/minimal-cpp: lib
	$(CXX) -std=c++11 $(CXXFLAGS) -g -Iinclude c-examples/minimal.cpp $(LIB)/libwis.a -o $@

$(BUILD)/wavelets: lib
	$(CC) -std=c99 $(CFLAGS) -g -Iinclude c-examples/wavelets.c $(LIB)/libwis.a -lm -o $@

$(BUILD)/wavelets-cpp: lib
	$(CXX) -std=c++11 $(CXXFLAGS) -g -Iinclude c-examples/wavelets.cpp $(LIB)/libwis.a -o $@

$(BUILD)/exr.o: c-examples/render/exr.cpp c-examples/render/read.h
	$(CXX) -std=c++11 $(CXXFLAGS) $(shell pkg-config --cflags OpenEXR) -c $< -o $@

C_RENDER  = $(CC) -std=c99 -D_POSIX_C_SOURCE=200809L $(CFLAGS) -Iinclude

$(BUILD)/demo: lib $(BUILD)/exr.o
	$(C_RENDER) c-examples/demo/main.c c-examples/demo/scene.c $(RENDER) $(LIB)/libwis.a $(EXR_LIBS) -lm -lpthread -o $@

demo: ## render the demonstration to build/demo.png: ENV=map.hdr or .exr for a light of your own
	scripts/setup.sh demo
	$(MAKE) $(BUILD)/demo
	$(BUILD)/demo $(if $(ENV),--map '$(ENV)') --out $(BUILD)/demo.png
	@echo "The picture is $(BUILD)/demo.png"

$(BUILD)/pathtracer: lib $(BUILD)/exr.o
	$(C_RENDER) c-examples/pathtracer/main.c $(TRACER) $(LIB)/libwis.a $(EXR_LIBS) -lm -lpthread -o $@

$(BUILD)/pathtracer-small: lib
	$(CC) -std=c99 $(CFLAGS) -Iinclude c-examples/pathtracer/small.c $(LIB)/libwis.a -lm -o $@

$(BUILD)/pathtracer-small-cpp: lib
	$(CXX) -std=c++11 $(CXXFLAGS) -Iinclude c-examples/pathtracer/small.cpp $(LIB)/libwis.a -o $@

pathtracer: ## compare MIS and direct in a path tracer, within two minutes: ENV=map.hdr ARGS='--most 16 --stratified 1'
	scripts/setup.sh demo
	$(MAKE) $(BUILD)/pathtracer
	$(BUILD)/pathtracer $(if $(ENV),--map '$(ENV)') $(ARGS)

pathtracer-page: ## run the path tracer under all lat-long maps of a folder and write docs/measurements/pathtracer.md: MAPS=folder
	scripts/setup.sh demo
	$(MAKE) $(BUILD)/pathtracer
	scripts/pathtracer-page.py $(BUILD)/pathtracer '$(MAPS)' docs/measurements/pathtracer.md

$(BUILD)/gallery-program: lib $(BUILD)/exr.o
	$(C_RENDER) $(wildcard c-examples/gallery/*.c) $(RENDER) $(LIB)/libwis.a -lassimp -lembree3 $(EXR_LIBS) -lm -lpthread -o $@

figure: ## draw strata, candidates, weights and rays under a map into docs/algorithm.svg: MAP=map.hdr
	$(CARGO) run --quiet --example figure -- '$(MAP)' docs/algorithm.svg

gallery: ## render six pictures by MIS and by wis_direct at equal time, into build/gallery: DATA=folder ENV=map.exr PAGE=1 for docs/gallery.md
	scripts/setup.sh gallery
	$(MAKE) $(BUILD)/gallery-program
	scripts/gallery.sh $(BUILD) '$(DATA)' '$(PAGE)' '$(ENV)'

hardcases: lib ## run the hard cases, print their table and write docs/measurements/hard-cases.md
	scripts/setup.sh test
	scripts/instruments.sh $(LIB) run --bin hardcases -- docs/measurements/hard-cases.md
	{ echo && scripts/provenance.sh hardcases; } >> docs/measurements/hard-cases.md

report: lib ## measure speed against error into docs/measurements/report.md, and every number into report/cells.tsv: QUICK=1 for a check, ARGS='--map FILE'
	scripts/setup.sh test
	scripts/earlier.sh
	scripts/instruments.sh $(LIB) run --bin measure -- report $(if $(QUICK),--quick,--docs docs/measurements/report.md) $(ARGS)
	$(if $(QUICK),,scripts/performance-page.py)

goals: lib ## hold the goals of 0.3 beside version 0.2, which is built from the history, and write docs/measurements/goals.md: QUICK=1 for a check
	scripts/setup.sh test
	scripts/earlier.sh
	scripts/instruments.sh $(LIB) run --bin measure -- goals $(if $(QUICK),$(BUILD)/goals-quick.md --quick,docs/measurements/goals.md)

performance: ## write docs/performance.md, docs/papers.md and the gains of README.md from the measured pages
	scripts/performance-page.py

check-pages: ## say which measured pages were made from other sources than those that are there
	scripts/check-pages.sh

light: lib ## measure the light beside pbrt's tables, and write docs/measurements/light.md: QUICK=1 for a check
	scripts/setup.sh test
	scripts/instruments.sh $(LIB) run --bin measure -- light $(if $(QUICK),$(BUILD)/light-quick.md --quick,docs/measurements/light.md)
	$(if $(QUICK),,scripts/performance-page.py)

rooms: lib ## measure rooms with and without portals and visibility caches, and write docs/measurements/rooms.md: QUICK=1 for a check
	scripts/setup.sh test
	scripts/instruments.sh $(LIB) run --bin measure -- rooms $(if $(QUICK),$(BUILD)/rooms-quick.md --quick,docs/measurements/rooms.md)

structured: lib ## go through the claims of structured importance sampling and write docs/measurements/sis-2003.md
	scripts/setup.sh test
	scripts/instruments.sh $(LIB) run --bin structured -- docs/measurements/sis-2003.md

wavelets: lib ## go through the claims of wavelet importance sampling and write docs/measurements/wis-2005.md
	scripts/setup.sh test
	scripts/instruments.sh $(LIB) run --bin wavelets -- docs/measurements/wis-2005.md

triple: lib ## measure triple product integrals and write docs/measurements/triple-2004.md
	scripts/setup.sh test
	scripts/instruments.sh $(LIB) run --bin triple -- docs/measurements/triple-2004.md

renderers: ## run rpt, threers and Mitsuba 3 as clients, test them, and write docs/renderers.md: QUICK=1 for a check
	scripts/setup.sh renderers
	scripts/test-renderers.sh $(BUILD) rpt $(BUILD)/rpt.md
	scripts/test-renderers.sh $(BUILD) threers $(BUILD)/threers.md
	cat $(BUILD)/rpt.md $(BUILD)/threers.md > $(BUILD)/others.md
	scripts/test-renderers.sh $(BUILD) mitsuba $(if $(QUICK),$(BUILD)/renderers-quick.md --quick,docs/renderers.md) --also $(BUILD)/others.md

cycles: ## hold a light against the look-up of Cycles, from Blender's Python module: 370 MB
	scripts/test-renderers.sh $(BUILD) cycles

test-renderers: renderers

web: ## build the browser's page, build/web/index.html: MIS and wis beside each other, one file, no network
	scripts/web.sh $(BUILD)/web

test-web: web lib ## open the browser's page without a window, at two widths: screenshots in build/test-web
	scripts/setup.sh browser
	$(CC) -std=c99 $(CFLAGS) -Iinclude python/tests/twenty.c $(LIB)/libwis.a -o $(BUILD)/twenty
	$(BUILD)/twenty > $(BUILD)/twenty.txt
	web/test.py $(BUILD)/web/index.html $(BUILD)/twenty.txt $(BUILD)/test-web

test-slow: ## what takes longer than a push may: mutants, real renderers, bits and archives of other platforms, the page in a browser
	$(MAKE) mutants
	$(MAKE) test-renderers QUICK=1
	$(MAKE) check-bits ALL=1
	$(MAKE) dist
	$(MAKE) test-web

dist: lib ## pack libraries, headers, licences and pages into build/wis-VERSION-PLATFORM.tar.gz, and build clients of them without Rust: PLATFORMS=native
	set -e; for platform in $(PLATFORMS); do scripts/dist.sh $(BUILD) $$platform; done

wheel: ## build the Python package, wis-direct, into build/wheels: a source distribution, and a wheel made from it
	rm -rf $(BUILD)/wheels
	python3 -m venv $(BUILD)/wheel-venv
	$(BUILD)/wheel-venv/bin/pip install --quiet build
	$(BUILD)/wheel-venv/bin/python -m build --outdir $(BUILD)/wheels python > $(BUILD)/wheels.log
	@du -b $(BUILD)/wheels/*

docs: ## write the reference of the C headers as HTML to build/docs/html
	scripts/setup.sh docs
	scripts/docs.sh $(BUILD)

abi: ## record the binary interface of wis.h and wis_lights.h in packaging/abi.txt: see docs/abi.md
	scripts/check-abi.sh --record

check-aarch64: ## run the tests of lanes and of recorded bits on AArch64, in an emulator
	scripts/check-aarch64.sh

check-thumb: ## build all of the library for ARM Cortex-M4F and link it without anything else: proof of no_std
	scripts/check-thumb.sh $(BUILD)/thumb

instructions: lib ## count the instructions of one call of wis_direct and the cache lines that it touches
	scripts/setup.sh test
	scripts/check-instructions.sh $(LIB) $(BUILD)/instructions --lines

check: ## after each change: format, lints and the laws of the renderer's path, in a minute
	scripts/check.sh

test: ## run everything that continuous integration runs
	scripts/setup.sh test
	scripts/test.sh $(BUILD)

fuzz: lib ## call every function with valid and hostile arguments: MINUTES=10 SEED=1
	scripts/fuzz.sh $(LIB) $(or $(MINUTES),10) $(SEED)

fuzz-guided: ## fuzz the kernel with its coverage as the guide: MINUTES=15, or INPUT=file of a failure, or INPUT=keep for fuzz/corpus.tar.gz
	scripts/setup.sh guided
	scripts/fuzz-guided.sh $(BUILD)/guided $(or $(MINUTES),15) $(INPUT)

growth: lib ## hold the work of every function to what its comment states
	scripts/setup.sh test
	scripts/check-growth.sh $(LIB) $(BUILD)/growth

check-bits: ## compare digests of the renderer's calls between optimisations, 32-bit x86 and AArch64: ALL=1 fails without one of them
	$(if $(ALL),scripts/setup.sh bits)
	scripts/check-bits.sh $(BUILD)/bits $(if $(ALL),--all)

coverage: ## count the lines of the kernel that its tests run: half an hour
	scripts/setup.sh coverage
	scripts/coverage.sh $(BUILD)/coverage

soak: lib ## 8 threads on one environment have the bits of one: MILLIONS=1000 of samples, SECONDS=600 at least
	$(CC) -std=gnu99 -O1 -Wall -Wextra -Iinclude c-examples/hosts/soak.c $(LIB)/libwis.a -lpthread -lm -o $(BUILD)/soak
	$(BUILD)/soak $(or $(MILLIONS),1000) $(or $(SECONDS),600)

sanitizers: lib ## run the C examples and hosts under the address and undefined-behaviour sanitizers
	scripts/check-sanitizers.sh $(LIB) $(BUILD)

mutants: ## break one rule at a time and see that a test notices: ONLY='split-clamp ...'
	scripts/setup.sh test
	scripts/mutants.sh $(ONLY)

clean: ## remove what was built
	$(CARGO) clean
	rm -rf $(BUILD)
