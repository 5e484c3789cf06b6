# Relief without a window, for machines of a cluster: docker build -t relief .
# With Mesa's drivers: a graphics card of AMD or Intel (--device /dev/dri), else the processors. An NVIDIA card is used
# where its container toolkit is (--gpus all): it brings the driver.
FROM rust:1.95-slim-bookworm AS build
RUN apt-get update -qq && apt-get install -qq -y --no-install-recommends gcc g++ libc6-dev
WORKDIR /relief
COPY . .
RUN cargo build --release --locked --no-default-features --features cli,physics,mcap --bin relief

FROM debian:bookworm-slim
# The last two are what NVIDIA's driver is linked with.
RUN apt-get update -qq && \
    apt-get install -qq -y --no-install-recommends libvulkan1 mesa-vulkan-drivers libegl1 libxext6 && \
    rm -rf /var/lib/apt/lists/*
COPY --from=build /relief/target/release/relief /opt/relief/relief
COPY assets /opt/relief/assets
ENV NVIDIA_VISIBLE_DEVICES=all NVIDIA_DRIVER_CAPABILITIES=graphics,utility NODEVICE_SELECT=1
ENTRYPOINT ["/opt/relief/relief"]
CMD ["info"]
