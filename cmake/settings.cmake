# Language, warnings, sanitizers and floating-point rules of every target.
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/bin)
if(NOT CMAKE_BUILD_TYPE)
    set(CMAKE_BUILD_TYPE Release CACHE STRING "" FORCE)
endif()

option(RELUME_TESTS "Build the tests; the bench needs them" ON)
option(RELUME_BENCH "Build the bench, and its tests" ON)
option(RELUME_WERROR "Treat warnings as errors" OFF)
set(RELUME_SANITIZER "" CACHE STRING "Sanitizers, e.g. address,undefined or thread")

find_program(RELUME_CCACHE ccache)
if(RELUME_CCACHE)
    set(CMAKE_CXX_COMPILER_LAUNCHER ${RELUME_CCACHE})
endif()

# Same bits in every build of one compiler: no contraction, never -ffast-math (docs/architecture.md).
add_compile_options(-ffp-contract=off)
option(RELUME_FUZZ "Instrument everything for libFuzzer (clang), and build tests/fuzz" OFF)
if(RELUME_FUZZ)
    add_compile_options(-fsanitize=fuzzer-no-link)
    add_compile_definitions(_GLIBCXX_ASSERTIONS)
endif()
if(RELUME_SANITIZER)
    add_compile_options(-fsanitize=${RELUME_SANITIZER} -fno-omit-frame-pointer)
    add_link_options(-fsanitize=${RELUME_SANITIZER})
endif()

add_library(relume_warnings INTERFACE)
target_compile_options(relume_warnings INTERFACE -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor
    -Woverloaded-virtual -Wno-missing-field-initializers)
if(RELUME_WERROR)
    target_compile_options(relume_warnings INTERFACE -Werror)
endif()

# relume_library(NAME SOURCES... ) : static library relume_NAME with alias relume::NAME.
function(relume_library name)
    add_library(relume_${name} STATIC ${ARGN})
    add_library(relume::${name} ALIAS relume_${name})
    target_include_directories(relume_${name} PUBLIC ${PROJECT_SOURCE_DIR})
    target_link_libraries(relume_${name} PRIVATE relume_warnings)
endfunction()

# relume_test(NAME LABEL LIBRARIES... SOURCES files...) : one GoogleTest program, one ctest entry a case.
include(GoogleTest)
function(relume_test name label)
    cmake_parse_arguments(ARG "" "" "LIBS;SOURCES" ${ARGN})
    add_executable(${name} ${ARG_SOURCES})
    target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR})
    target_link_libraries(${name} PRIVATE relume_warnings ${ARG_LIBS} GTest::gmock GTest::gtest_main)
    target_compile_definitions(${name} PRIVATE RELUME_SOURCE_DIR="${PROJECT_SOURCE_DIR}"
        RELUME_BINARY_DIR="${CMAKE_BINARY_DIR}/bin")
    gtest_discover_tests(${name} DISCOVERY_MODE PRE_TEST PROPERTIES LABELS ${label} TIMEOUT 600)
endfunction()
