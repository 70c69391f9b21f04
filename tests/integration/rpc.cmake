# The server in this process, its clients and workers over gRPC on loopback.
relume_test(relume_rpc_test integration LIBS relume::rpc relume::channel relume::client relume::loop SOURCES
    rpc/blob_service_test.cpp rpc/finish_times_test.cpp rpc/hostile_client_test.cpp rpc/hostile_worker_test.cpp
    rpc/job_control_test.cpp rpc/job_service_test.cpp rpc/listen_address_test.cpp rpc/metrics_test.cpp rpc/owner_test.cpp rpc/quarantine_test.cpp
    rpc/renewed_worker_test.cpp rpc/restart_test.cpp rpc/server_test.cpp rpc/silence_test.cpp rpc/tls_test.cpp
    rpc/work_service_test.cpp)
