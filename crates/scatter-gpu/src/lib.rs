//! Volumetric shadows on the GPU: encodes god rays into an engine's own wgpu command buffer.

pub use wgpu;

#[cfg(test)]
mod tests {
    #[test]
    fn an_adapter_is_found() {
        let instance = wgpu::Instance::default();
        let adapter =
            pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions::default())).unwrap();
        println!("{:?}", adapter.get_info());
        pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor::default())).unwrap();
    }
}
