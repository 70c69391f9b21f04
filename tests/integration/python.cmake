# A client in another language, made with protoc and grpc_python_plugin from proto/.
add_test(NAME PythonClient.SubmitsWatchesAndFetches
    COMMAND /usr/bin/python3 ${CMAKE_CURRENT_SOURCE_DIR}/python/service_test.py
        ${CMAKE_BINARY_DIR}/bin ${PROJECT_SOURCE_DIR})
set_tests_properties(PythonClient.SubmitsWatchesAndFetches PROPERTIES
    LABELS integration TIMEOUT 300 ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)
