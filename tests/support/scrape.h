#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <map>
#include <sstream>
#include <stdexcept>
#include <string>

namespace relume {

// What an HTTP server on this machine answers to GET: head and body.
inline std::string HttpGet(int port, const std::string& path) {
    const int fd = socket(AF_INET, SOCK_STREAM, 0);
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(static_cast<std::uint16_t>(port));
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (connect(fd, reinterpret_cast<const sockaddr*>(&to), sizeof to) != 0) {
        close(fd);
        throw std::runtime_error("nobody listens on the port");
    }
    const std::string request = "GET " + path + " HTTP/1.0\r\nHost: localhost\r\n\r\n";
    std::string answer;
    if (send(fd, request.data(), request.size(), MSG_NOSIGNAL) ==
        static_cast<ssize_t>(request.size())) {
        char buffer[4096];
        for (ssize_t n = 0; (n = recv(fd, buffer, sizeof buffer, 0)) > 0;) {
            answer.append(buffer, static_cast<std::size_t>(n));
        }
    }
    close(fd);
    return answer;
}

// A page of Prometheus' text format: values by series, "name" or "name{label="value",...}" as
// written, and types by family.
struct Exposition {
    std::map<std::string, double> values;
    std::map<std::string, std::string> types;

    double At(const std::string& series) const { return values.at(series); }
    bool Has(const std::string& series) const { return values.count(series) != 0; }
};

inline Exposition ParseExposition(const std::string& text) {
    Exposition exposition;
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
        std::istringstream words(line);
        std::string hash, keyword, name, type;
        if (line.rfind("# TYPE ", 0) == 0) {
            words >> hash >> keyword >> name >> type;
            exposition.types[name] = type;
        } else if (!line.empty() && line[0] != '#') {
            const std::size_t space = line.rfind(' ');
            exposition.values[line.substr(0, space)] = std::stod(line.substr(space + 1));
        }
    }
    return exposition;
}

// What a server's metrics say now.
inline Exposition Scrape(int port) {
    const std::string answer = HttpGet(port, "/metrics");
    if (answer.find(" 200 ") == std::string::npos) {
        throw std::runtime_error("no page: " + answer.substr(0, answer.find('\r')));
    }
    return ParseExposition(answer.substr(answer.find("\r\n\r\n") + 4));
}

}  // namespace relume
