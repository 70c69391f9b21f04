// What server/denoise/oidn_library.cpp calls of Open Image Denoise 2.3, for its test: a stand-in
// for a library that machines without it can't link. Names and numbers are that library's.
#pragma once

#include <cstddef>

extern "C" {

typedef enum { OIDN_DEVICE_TYPE_DEFAULT = 0, OIDN_DEVICE_TYPE_CPU = 1 } OIDNDeviceType;
typedef enum {
    OIDN_ERROR_NONE = 0,
    OIDN_ERROR_UNKNOWN = 1,
    OIDN_ERROR_INVALID_ARGUMENT = 2,
    OIDN_ERROR_INVALID_OPERATION = 3,
    OIDN_ERROR_OUT_OF_MEMORY = 4,
    OIDN_ERROR_UNSUPPORTED_HARDWARE = 5,
    OIDN_ERROR_CANCELLED = 6
} OIDNError;
typedef enum {
    OIDN_FORMAT_UNDEFINED = 0,
    OIDN_FORMAT_FLOAT = 1,
    OIDN_FORMAT_FLOAT3 = 3
} OIDNFormat;
typedef enum {
    OIDN_QUALITY_DEFAULT = 0,
    OIDN_QUALITY_FAST = 4,
    OIDN_QUALITY_BALANCED = 5,
    OIDN_QUALITY_HIGH = 6
} OIDNQuality;
typedef struct OIDNDeviceImpl* OIDNDevice;
typedef struct OIDNFilterImpl* OIDNFilter;
typedef bool (*OIDNProgressMonitorFunction)(void* user, double done);

OIDNDevice oidnNewDevice(OIDNDeviceType type);
void oidnReleaseDevice(OIDNDevice device);
void oidnSetDeviceBool(OIDNDevice device, const char* name, bool value);
void oidnSetDeviceInt(OIDNDevice device, const char* name, int value);
OIDNError oidnGetDeviceError(OIDNDevice device, const char** message);
void oidnCommitDevice(OIDNDevice device);

OIDNFilter oidnNewFilter(OIDNDevice device, const char* type);
void oidnReleaseFilter(OIDNFilter filter);
void oidnSetSharedFilterImage(OIDNFilter filter, const char* name, void* data, OIDNFormat format,
                              std::size_t width, std::size_t height, std::size_t offset,
                              std::size_t pixel_stride, std::size_t row_stride);
void oidnSetFilterBool(OIDNFilter filter, const char* name, bool value);
void oidnSetFilterInt(OIDNFilter filter, const char* name, int value);
void oidnSetFilterProgressMonitorFunction(OIDNFilter filter, OIDNProgressMonitorFunction function,
                                          void* user);
void oidnCommitFilter(OIDNFilter filter);
void oidnExecuteFilter(OIDNFilter filter);
}
