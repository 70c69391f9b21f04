# Processes on loopback, driven from outside: a client in another language (made with protoc and
# grpc_python_plugin from proto/), the same bits whoever renders, what goes wrong, and
# what images claim, and what the default filter takes.
function(relume_python_test name script)
    add_test(NAME ${name}
        COMMAND /usr/bin/python3 ${CMAKE_CURRENT_SOURCE_DIR}/python/${script}
            ${CMAKE_BINARY_DIR}/bin ${PROJECT_SOURCE_DIR})
    set_tests_properties(${name} PROPERTIES
        LABELS integration TIMEOUT 600 ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)
endfunction()

relume_python_test(PythonClient.SubmitsWatchesAndFetches service_test.py)
relume_python_test(Farm.SameBitsWhoeverRenders digest_test.py)
relume_python_test(Restart.CostsNoBitWhateverIsKilled restart_test.py)
relume_python_test(Jobs.WaitShareAndEndAsTheyAreTold jobs_test.py)
relume_python_test(Losses.CostTheJobThatIsToBlame losses_test.py)
relume_python_test(Commands.FailWithOneClearLine errors_test.py)
relume_python_test(Verify.TellsTrueClaimsFromForgedOnes verify_test.py)
relume_python_test(Tls.LetsInWhoMayAndSaysWhyNot tls_test.py)
relume_python_test(Budgets.EndJobsAndSayWhich budgets_test.py)
relume_python_test(Filters.ChooseAndPlanByTheirRules filters_test.py)
relume_python_test(Metrics.AreScrapedFromAFarmAndLogsParse metrics_test.py)
relume_python_test(Stability.DefaultIsNoWorseThanUnfiltered stability_test.py)
# A minute on idle cores, but some hundred processes.
set_tests_properties(Stability.DefaultIsNoWorseThanUnfiltered PROPERTIES TIMEOUT 1800)
# Networks against PyTorch, where there is one.
add_executable(relume-network-runner network_runner.cpp)
target_link_libraries(relume-network-runner PRIVATE relume_warnings relume::denoise)
relume_python_test(Networks.EqualPyTorch network_test.py)
set_tests_properties(Networks.EqualPyTorch PROPERTIES SKIP_RETURN_CODE 77)
relume_python_test(ChaosTool.DisturbsAFarmAndLeavesItWell chaos_tool_test.py)
# A short run of tests/chaos; `tests/chaos --rounds 100` is the long one. Sanitizers make it ten times as long.
set(chaos_rounds $<IF:$<BOOL:${RELUME_SANITIZER}>,3,10>)
add_test(NAME Chaos.RoundsEndWithTheBitsOfUndisturbedRuns
    COMMAND /usr/bin/python3 ${PROJECT_SOURCE_DIR}/tests/chaos --rounds ${chaos_rounds} --seed 7 --longest 2
        --bin ${CMAKE_BINARY_DIR}/bin)
set_tests_properties(Chaos.RoundsEndWithTheBitsOfUndisturbedRuns PROPERTIES
    LABELS "integration;chaos" TIMEOUT 1200 ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)
