#!/bin/sh
# Compiles the headers alone and included twice, and minimal programs, as C and C++ of several years, with each compiler.
set -eu
cd "$(dirname "$0")/../c-examples/header"

strict="-Wall -Wextra -Wpedantic -Werror -fsyntax-only -I../../include"

compile() {
    echo "$*"
    # The flags are split into words on purpose.
    # shellcheck disable=SC2086
    "$@" $strict
}

for compiler in gcc clang; do
    for standard in c99 c11; do
        for header in wis wis_lights wis_wavelets; do
            compile $compiler -std=$standard -x c ../../include/$header.h
        done
        compile $compiler -std=$standard twice.c
        compile $compiler -std=$standard ../minimal.c
    done
done

for compiler in g++ clang++; do
    for standard in c++11 c++17; do
        for header in wis wis_lights wis_wavelets; do
            compile $compiler -std=$standard -x c++ ../../include/$header.h
        done
        for header in wis wis_wavelets; do
            compile $compiler -std=$standard -x c++ ../../include/$header.hpp
        done
        compile $compiler -std=$standard twice.cpp
        compile $compiler -std=$standard wrapper.cpp
        compile $compiler -std=$standard -DWIS_HPP_THROW wrapper.cpp
        compile $compiler -std=$standard -fno-exceptions ../minimal.cpp
    done
done
